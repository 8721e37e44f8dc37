"""The command line as a user meets it: help that teaches, one-line errors, exit codes."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest


def svaedc(*arguments: str, folder: Path) -> subprocess.CompletedProcess[str]:
    environment = {name: value for name, value in os.environ.items() if name != "RAY_ADDRESS"}
    return subprocess.run(
        [str(Path(sys.executable).parent / "svaedc"), *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env=environment,
    )


COMPARE = ("compare", "--setup", "franka", "--out", "out", "--address", "127.0.0.1:1")
COLLECT = ("collect", "--episodes", "8", "--dataset", "data")


def test_help_names_every_command_and_loads_neither_ray_nor_torch(tmp_path):
    result = svaedc("--help", folder=tmp_path)
    assert result.returncode == 0
    for command in (
        "demo",
        "collect",
        "train",
        "compare",
        "reproduce",
        "render",
        "ui",
        "dataset",
        "hardware",
    ):
        assert command in result.stdout
    heavy = {"ray", "torch", "mlflow", "pybullet"}
    loaded = f"import cluster.cli.main, sys; print(sorted({heavy} & sys.modules.keys()))"
    listed = subprocess.run([sys.executable, "-c", loaded], capture_output=True, text=True, check=True)
    assert listed.stdout.strip() == "[]"


@pytest.mark.parametrize(
    ("arguments", "code", "message"),
    [
        ((*COLLECT, "--setup", "frnaka"), 2, "unknown setup 'frnaka'; did you mean 'franka'?"),
        ((*COLLECT, "--setup", "franka", "--set", "collect.actor=2"), 2, "did you mean 'collect.actors'?"),
        (
            (*COLLECT, "--setup", "franka", "--config", "none.yaml"),
            2,
            "cannot read the settings file none.yaml",
        ),
        (
            (*COLLECT, "--setup", "franka", "--address", "127.0.0.1:1"),
            1,
            "no Ray cluster answers at 127.0.0.1:1",
        ),
        (
            (*COLLECT, "--setup", "franka", "--set", "tracking.uri=sqlite:////proc/none/mlflow.db"),
            1,
            "the MLflow store sqlite:////proc/none/mlflow.db cannot be used",
        ),
        (("dataset", "info", "nowhere"), 1, "nowhere holds no dataset"),
        (("dataset", "verify", "nowhere"), 1, "nowhere holds no dataset"),
        (("hardware", "status", "nowhere"), 1, "nowhere"),
        (("collect",), 2, "Missing option"),
        # That nothing answers there would be found out first, if Ray were started before the refusal.
        ((*COMPARE, "--methods", ","), 2, "--methods must name at least one of bbk-kl, botorch"),
        (
            ("reproduce", "figure-9", "--dataset", "data", "--episodes", "300", "--plan"),
            2,
            "--dataset is collected already: leave one out",
        ),
        (("reproduce", "figure-9", "--set", "train.latent=15x12"), 2, "leave train.latent out"),
        ((*COMPARE, "--methods", "se,svae"), 2, "svae need a trained model: name its folder with --model"),
    ],
)
def test_a_mistake_is_one_message_and_an_exit_code(tmp_path, arguments, code, message):
    result = svaedc(*arguments, folder=tmp_path)
    assert result.returncode == code, result.stderr
    assert message in " ".join(result.stderr.replace("│", " ").split())
    assert "Traceback" not in result.stderr


def test_dataset_info_and_verify_tell_a_whole_dataset_from_a_broken_one(small_dataset, tmp_path):
    info = svaedc("dataset", "info", str(small_dataset), folder=tmp_path)
    assert info.returncode == 0, info.stderr
    assert "16 in 2 shards" in info.stdout
    assert "object_tipped" in info.stdout
    assert re.search(r"diverged +0\b", info.stdout)
    assert re.search(r"stopped +0\b", info.stdout)
    assert svaedc("dataset", "verify", str(small_dataset), folder=tmp_path).returncode == 0
    broken = tmp_path / "broken"
    broken.mkdir()
    for path in small_dataset.iterdir():
        if path.is_file():
            (broken / path.name).write_bytes(path.read_bytes())
    victim = min(broken.glob("*.parquet"))
    content = bytearray(victim.read_bytes())
    content[5000] ^= 1
    victim.write_bytes(content)
    result = svaedc("dataset", "verify", str(broken), folder=tmp_path)
    assert result.returncode == 1
    assert victim.name in result.stdout
    assert f"`svaedc dataset repair {broken}` recomputes what is broken" in result.stderr


def test_a_job_refuses_paths_that_ray_will_delete(tmp_path):
    package = tmp_path / "working_dir_files" / "_ray_pkg_1"
    package.mkdir(parents=True)
    result = svaedc(*COLLECT, "--setup", "franka", folder=package)
    assert result.returncode == 2, result.stderr
    assert "data would be deleted with the job's copy of the working directory" in result.stderr
    absolute = ("collect", "--episodes", "8", "--dataset", str(tmp_path / "data"), "--setup", "franka")
    result = svaedc(*absolute, folder=package)
    assert result.returncode == 2, result.stderr
    assert "mlflow.db would be deleted" in result.stderr


def test_a_gap_is_told_from_damage_and_condemns_no_file(small_dataset, tmp_path):
    gappy = tmp_path / "gappy"
    shutil.copytree(small_dataset, gappy)
    first = min(gappy.glob("*.parquet"))
    first.unlink()
    first.with_name(f"{first.name}.sha256").unlink()
    result = svaedc("dataset", "verify", str(gappy), folder=tmp_path)
    assert result.returncode == 1
    assert result.stdout == "episodes 0 to 7 are not collected yet\n"
    assert "every file in" in result.stderr
    assert "delete" not in result.stderr
    assert svaedc("dataset", "info", str(gappy), folder=tmp_path).returncode == 0
