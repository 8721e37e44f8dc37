"""The examples without PyBullet, on the command line, from a copy of the folder they are in."""

import shutil

import numpy as np
import pytest
from PIL import Image

from tests.cluster.cli import command_line
from tests.end_to_end.test_own_robot import EXAMPLE, svaedc
from workers.dataset.folder import open_dataset
from workers.dataset.verification import verify

pytestmark = pytest.mark.slow


@pytest.fixture(params=["cart_pole", "gymnasium_hopper"])
def folder(request, tmp_path):
    if request.param == "gymnasium_hopper":
        pytest.importorskip("mujoco")
    ignored = shutil.ignore_patterns("__pycache__", "data", "*.gif", "*.png")
    return shutil.copytree(EXAMPLE.parent / request.param, tmp_path / request.param, ignore=ignored)


def draw(folder, x: str, out: str):
    return command_line.svaedc("render", "--setup", folder.name, "--x", x, "--out", out, folder=folder)


@pytest.mark.slow
def test_an_example_is_collected_and_drawn_from_its_folder(folder):
    name = folder.name
    done = svaedc(folder, "collect", "--setup", name, "--dataset", "data", "--episodes", "24")
    assert done.returncode == 0, done.stderr
    dataset = open_dataset(folder / "data")
    assert [problem for _, problems in verify(dataset) for problem in problems] == []
    ((_, columns),) = dataset.batches()
    assert len({xi.tobytes() for xi in columns.xi}) == 24
    assert 0.05 < columns.y.mean() < 0.95
    assert np.ptp(columns.f) > 0.2

    drawn = draw(folder, "dataset:data:3", "clip.gif")
    assert drawn.returncode == 0, drawn.stderr
    stills = draw(folder, "random:3", "stills.png")
    assert stills.returncode == 0, stills.stderr
    with Image.open(folder / "clip.gif") as clip, Image.open(folder / "stills.png") as image:
        assert clip.size == (360, 270)
        assert clip.n_frames >= 40
        assert image.size == (3 * 360, 2 * 270)
        first, last = (np.asarray(image.crop(box)) for box in ((0, 40, 360, 270), (720, 310, 1080, 540)))
    assert (first != last).mean() > 0.005
