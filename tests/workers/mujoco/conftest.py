"""Setups in MuJoCo, and the same robots in PyBullet."""

import pytest

from workers import setups

pytest.importorskip("mujoco")

ROBOTS = ("franka", "yumi", "daisy-27d", "daisy-11d")


@pytest.fixture(scope="module", params=ROBOTS)
def robot(request):
    return request.param


@pytest.fixture(scope="module")
def setup(robot):
    return setups.load(f"{robot}-mujoco")
