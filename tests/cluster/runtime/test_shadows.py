"""Files of a user's that hide libraries from Ray's processes."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from cluster.config import RaySettings
from cluster.errors import UserError
from cluster.runtime.session import connect
from cluster.runtime.shadows import NEEDED, require_no_shadows

POISON = 'raise SystemExit("imported")\n'
WORKERS = (
    "ray._private.workers.default_worker",
    "cluster.comparison.worker",
    "cluster.datasets.worker",
    "cluster.hardware.actor",
    "cluster.training.worker",
    "workers.simulation.bullet",
)


@pytest.mark.parametrize(
    "name", ["workers", "cluster", "svaedc", "torch", "ray", "pybullet", "random", "code", "sympy"]
)
def test_a_file_that_hides_a_library_is_named_with_the_remedy_and_not_imported(tmp_path, name):
    (tmp_path / f"{name}.py").write_text(POISON, encoding="utf-8")
    with pytest.raises(UserError, match=rf"{name}\.py hides .*{name}.* from the processes .*: rename it"):
        require_no_shadows(tmp_path)


def test_a_package_hides_a_library_and_a_folder_of_data_does_not(tmp_path):
    (tmp_path / "workers").mkdir()
    require_no_shadows(tmp_path)
    (tmp_path / "workers" / "__init__.py").write_text(POISON, encoding="utf-8")
    with pytest.raises(UserError, match=r"/workers hides .*/workers/__init__\.py"):
        require_no_shadows(tmp_path)


@pytest.mark.parametrize(
    "name",
    ["test.py", "tests.py", "my_robot.py", "utils.py", "sys.py", "ray.txt", "ray_config.yaml", "__main__.py"],
)
def test_files_that_hide_nothing_are_let_alone(tmp_path, name):
    (tmp_path / name).write_text(POISON, encoding="utf-8")
    require_no_shadows(tmp_path)
    (tmp_path / "torch.py").write_text(POISON, encoding="utf-8")
    with pytest.raises(UserError, match=r"torch\.py hides"):  # and it is not that nothing is looked at
        require_no_shadows(tmp_path)


def test_the_packages_own_folder_hides_nothing(tmp_path):
    """Neither by its own name nor by another."""
    repository = Path(__file__).parents[3]
    require_no_shadows(repository)
    (tmp_path / "checkout").symlink_to(repository)
    require_no_shadows(tmp_path / "checkout")


def test_a_library_in_an_environment_below_the_folder_is_hidden_too(tmp_path, monkeypatch):
    (tmp_path / ".venv").mkdir()
    for folder in (tmp_path, tmp_path / ".venv"):
        (folder / "sympy.py").write_text(POISON, encoding="utf-8")
    monkeypatch.syspath_prepend(tmp_path / ".venv")
    monkeypatch.delitem(sys.modules, "sympy", raising=False)
    with pytest.raises(UserError, match=r"sympy\.py hides .*\.venv/sympy\.py"):
        require_no_shadows(tmp_path)


def test_it_is_found_before_ray_starts(tmp_path, monkeypatch):
    (tmp_path / "workers.py").write_text(POISON, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(UserError, match=r"workers\.py hides"):
        connect(RaySettings(), None).__enter__()


@pytest.mark.parametrize("name", ["workers", "svaedc"])
def test_a_package_hidden_from_the_command_itself_is_one_line(tmp_path, name):
    (tmp_path / f"{name}.py").write_text(POISON, encoding="utf-8")
    repository = Path(__file__).parents[3]
    done = subprocess.run(
        [sys.executable, "-c", "from cluster.cli.main import main"],
        env={**os.environ, "PYTHONPATH": f"{tmp_path}{os.pathsep}{repository}"},
        cwd=tmp_path.parent,
        capture_output=True,
        encoding="utf-8",
        check=False,
    )
    assert (done.returncode, done.stderr.count("\n")) == (1, 1), done.stderr
    assert done.stderr.startswith(f"error: {tmp_path / name}.py hides {repository / name}: rename it")


def test_all_that_workers_load_beyond_their_driver_is_known():
    """The driver's modules and the standard library are known anyway."""
    before, after = loaded("cluster.runtime.session", "cluster.tracking"), loaded(*WORKERS)
    unknown = after - before - NEEDED - sys.stdlib_module_names
    assert {name for name in unknown if not name.startswith(("_", "colorful", "mypy_", "pyre_"))} == set()


def loaded(*modules: str) -> set[str]:
    program = f"import sys; [__import__(name) for name in {modules!r}]; print(*sys.modules)"
    said = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, encoding="utf-8", check=True
    ).stdout
    return {name.partition(".")[0] for name in said.split()}
