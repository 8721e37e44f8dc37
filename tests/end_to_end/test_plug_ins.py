"""Plug-ins as users meet them: an installed package, and files in the working directory; on Ray as well."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.packages import install

PACKAGE = '''
"""Setups and methods of a lab."""
from dataclasses import replace
from workers import setups

def setup():
    """The quadratic, three steps long."""
    return replace(setups.load("quadratic-30d"), horizon=3)

class Center:
    """The centre of the cube, moved a little."""
    def __init__(self, problem):
        self.dimensions = problem.dimensions
    def suggest(self, history, rng):
        return 0.5 + 0.01 * rng.random(self.dimensions)
'''
OWN = '''
"""A method in the working directory."""
import numpy as np

def corner(problem):
    """Always the best corner."""
    return Corner(problem.dimensions)

class Corner:
    def __init__(self, dimensions):
        self.dimensions = dimensions
    def suggest(self, history, rng):
        return np.ones(self.dimensions)
'''
OFFERS = {
    "svaedc.setups": {"lab-quadratic": "lab_package:setup", "lab-gone": "lab_gone:setup"},
    "svaedc.methods": {"center": "lab_package:Center"},
}
COMPARE = (
    "compare",
    "--setup",
    "lab-quadratic",
    "--methods",
    "random,center,own_method:corner",
    "--out",
    "out",
)
GRID = ("--runs", "2", "--trials", "2", "--set", "compare.slots=2", "--set", "ray.num_cpus=2")


@pytest.fixture
def folder(tmp_path):
    install(tmp_path / "site", "lab-package", OFFERS, lab_package=PACKAGE)
    (tmp_path / "work").mkdir()
    (tmp_path / "work" / "own_method.py").write_text(OWN)
    return tmp_path / "work"


def svaedc(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The installed command, with the package on Python's path and nothing else that is new."""
    path = os.pathsep.join(filter(None, [str(folder.parent / "site"), os.environ.get("PYTHONPATH")]))
    environment = {name: value for name, value in os.environ.items() if name != "RAY_ADDRESS"}
    return subprocess.run(
        [str(Path(sys.executable).parent / "svaedc"), *arguments],
        capture_output=True,
        text=True,
        check=False,
        cwd=folder,
        env={**environment, "PYTHONPATH": path},
    )


def test_lists_name_what_ships_and_what_packages_offer_and_go_on_behind_a_broken_one(folder):
    setups, methods, robots = (svaedc(folder, name) for name in ("setups", "methods", "robots"))
    assert [each.returncode for each in (setups, methods, robots)] == [0, 0, 0]
    lines = {line.split()[0]: line for line in setups.stdout.splitlines()}
    assert "30-D, 3 steps" in lines["lab-quadratic"]
    assert lines["lab-quadratic"].endswith(
        "The quadratic, three steps long.  [lab-package 1.0: lab_package:setup]"
    )
    assert "error: cannot import the module 'lab_gone'" in lines["lab-gone"]
    assert "48-D, 500 steps" in lines["franka"]
    assert "The centre of the cube, moved a little.  [lab-package 1.0: lab_package:Center]" in methods.stdout
    assert "rehearsal:SETUP" in robots.stdout


@pytest.mark.slow
def test_a_setup_and_methods_of_others_are_compared_on_ray_and_a_changed_file_is_named(folder):
    done = svaedc(folder, *COMPARE, *GRID)
    assert done.returncode == 0, done.stderr
    summary = json.loads((folder / "out" / "summary.json").read_text())
    best = {name: method["best"][-1]["mean"] for name, method in summary["methods"].items()}
    assert best["own_method:corner"] == pytest.approx(120.0)
    assert 67.5 <= best["center"] < 80.0
    identity = json.loads((folder / "out" / "comparison.json").read_text())
    assert (identity["setup"], list(identity["method_digests"])) == (
        "lab-quadratic",
        ["center", "own_method:corner"],
    )
    package = folder.parent / "site" / "lab_package.py"
    package.write_text(PACKAGE.replace("horizon=3", "horizon=4"))
    again = svaedc(folder, *COMPARE, *GRID)
    assert again.returncode == 1
    assert "lab_package.py has changed since the comparison in" in again.stderr
    assert "(horizon was 3, is 4); put the file back as it was" in again.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("collect", "--setup", "lab-quadratc", "--episodes", "8", "--dataset", "data"),
            "did you mean 'lab-quadratic'",
        ),
        (
            (*COMPARE[:3], "--out", "out", "--methods", "own_method:cornre"),
            "has no 'cornre'; did you mean 'corner'",
        ),
        (
            ("hardware", "start", "one", "--robot", "own_method:corner", "--method", "random"),
            "failed with TypeError",
        ),
        (
            ("hardware", "start", "one", "--robot", "rehearsal:lab-gone"),
            "cannot import the module 'lab_gone'",
        ),
    ],
)
def test_a_wrong_name_is_one_line_before_anything_starts(folder, arguments, message):
    done = svaedc(folder, *arguments)
    assert done.returncode == 2, done.stderr
    assert message in done.stderr
    assert "Traceback" not in done.stderr
