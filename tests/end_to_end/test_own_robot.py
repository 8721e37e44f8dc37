"""The example of a user's own robot, on the command line, from the folder it is in."""

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from workers.dataset.folder import open_dataset
from workers.dataset.verification import verify

EXAMPLE = Path(__file__).parents[2] / "examples" / "two_link_pusher"
GENTLE = """
import numpy as np

def bent(observed):
    shoulder, elbow, _, _ = observed.xi
    return np.minimum(abs(elbow) / 3, 1)
"""
BROKEN = GENTLE.replace("/ 3, 1)", "/ 3, 9) + 1")


@pytest.fixture
def folder(tmp_path):
    """A user's folder: a copy of the example, and a G_bad beside it."""
    copy = shutil.copytree(EXAMPLE, tmp_path / "mine", ignore=shutil.ignore_patterns("__pycache__", "data"))
    (copy / "gentle.py").write_text(GENTLE)
    (copy / "broken.py").write_text(BROKEN)
    return copy


def svaedc(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The installed command, whose own folder comes first on Python's path, not the working directory."""
    settings = ("tracking.uri=sqlite:///mlflow.db", "ray.num_cpus=2")
    command = [str(Path(sys.executable).parent / "svaedc"), *arguments]
    command += [word for setting in settings for word in ("--set", setting)]
    return subprocess.run(command, capture_output=True, text=True, check=False, cwd=folder)


COLLECT = ("collect", "--setup", "two_link_pusher", "--dataset", "data", "--episodes")


def test_a_robot_and_a_g_bad_of_ones_own_are_collected_from_their_folder(folder):
    done = svaedc(folder, *COLLECT, "24", "--repeats", "2", "--bad", "gentle:bent")
    assert done.returncode == 0, done.stderr
    dataset = open_dataset(folder / "data")
    assert [problem for _, problems in verify(dataset) for problem in problems] == []
    assert (dataset.identity.setup, dataset.identity.repeats) == ("two_link_pusher", 2)
    ((_, columns),) = dataset.batches()
    assert columns.bad == pytest.approx(abs(columns.xi[:, 1]) / 3, abs=1e-6)
    assert len({x.tobytes() for x in columns.x}) == 12


def test_a_wrong_g_bad_ends_the_command_with_one_line_before_any_episode(folder):
    done = svaedc(folder, *COLLECT, "24", "--bad", "broken:bent")
    assert done.returncode == 1
    assert "error: broken:bent must return numbers in [0, 1], got 1." in done.stderr
    assert "Traceback" not in done.stderr
    assert not (folder / "data").exists()


@pytest.mark.slow
def test_the_example_is_collected_trained_on_and_compared(folder):
    assert svaedc(folder, *COLLECT, "600").returncode == 0
    train = svaedc(folder, "train", "--dataset", "data", "--model", "model", "--set", "train.updates=300")
    assert (folder / "model" / "model.pt").exists(), train.stderr
    grid = ("--methods", "random,svae-dc", "--runs", "2", "--trials", "3")
    compare = svaedc(
        folder, "compare", "--setup", "two_link_pusher", "--model", "model", "--out", "out", *grid
    )
    assert compare.returncode == 0, compare.stderr
    assert "svae-dc: best after 5 trials" in compare.stderr + compare.stdout
    assert (folder / "out" / "figure.png").exists()
