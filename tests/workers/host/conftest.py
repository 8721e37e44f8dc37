"""Robots whose host is a real process, and whose arm writes down what it was told."""

import os
import sys
from pathlib import Path

import numpy as np
import pytest

from workers.hardware.host_process import Machinery
from workers.hardware.hosted import HostedRobot
from workers.host.home import RobotHome
from workers.host.limits import RobotLimits

ROOT = Path(__file__).parents[3]
MACHINE = "tests.workers.host.arm:Arm"
X = np.array([0.25, 0.75])


@pytest.fixture
def home(tmp_path):
    return RobotHome(tmp_path / "home", "desk").make()


@pytest.fixture
def log(tmp_path):
    return tmp_path / "commands.log"


@pytest.fixture
def arm(home, log, monkeypatch):
    """(trouble, ...) -> the robot behind its host; ended with the test."""
    monkeypatch.chdir(ROOT)
    made = []

    def connect(trouble="", limits=None, period=None, python=sys.executable, **settings):
        machinery = Machinery(MACHINE, python, {"log": os.fspath(log), "trouble": trouble, **settings})
        made.append(
            HostedRobot("desk", "desk", home, machinery, RobotLimits.read(limits or {}, "limits"), period)
        )
        return made[-1]

    yield connect
    for robot in made:
        robot.stop()
