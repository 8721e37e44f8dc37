"""The rehearsal robot: the setup under hidden physics, at a robot's pace."""

import hashlib
import threading

import numpy as np
import pytest

from tests.own_robot import write_robot
from workers import setups
from workers.hardware.driver import RobotFault
from workers.hardware.rehearsal import RehearsalRobot
from workers.randomness import Stream, generator
from workers.rollout import rollout

FRANKA = "franka-rehearsal"


@pytest.fixture(scope="module")
def franka():
    return setups.load("franka")


@pytest.fixture(scope="module")
def x(franka):
    return generator(0, Stream.CONTROLLER, 0).random(franka.dimensions)


def test_a_rehearsal_measures_the_setup_under_the_hidden_physics_of_its_seed(franka, x, tmp_path):
    measured = RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path).run("a", x)
    physics = franka.gap("wide").draw(generator(5, Stream.HIDDEN_PHYSICS, 0))
    with franka.open() as environment:
        episode = rollout(franka, environment, x.astype(np.float32), physics)
    assert (measured.f, measured.y, measured.stop) == (episode.f, episode.y, episode.stop)
    assert measured.evidence == hashlib.sha256(episode.xi.tobytes()).hexdigest()


def test_two_trials_of_one_controller_measure_the_same_and_another_seed_another(franka, x, tmp_path):
    robot = RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path)
    other = RehearsalRobot(FRANKA, franka, 6, 0.0, tmp_path)
    first, second, third = robot.run("a", x), robot.run("b", x), other.run("c", x)
    assert first.evidence == second.evidence != third.evidence


def test_a_trial_takes_at_least_its_pace(franka, x, tmp_path):
    assert RehearsalRobot(FRANKA, franka, 5, 0.4, tmp_path).run("a", x).seconds >= 0.4


@pytest.mark.parametrize("pace", [-1.0, 1e10, float("inf"), float("nan")])
def test_a_pace_that_nothing_can_wait_for_is_refused(franka, tmp_path, pace):
    with pytest.raises(ValueError, match=r"pace must lie in \[0, 86400\] s, got"):
        RehearsalRobot(FRANKA, franka, 5, pace, tmp_path)


def test_a_stop_in_motion_is_a_fault_without_measurement(franka, x, tmp_path):
    robot = RehearsalRobot(FRANKA, franka, 5, 60.0, tmp_path)
    stop = threading.Timer(0.5, robot.stop)
    stop.start()
    with pytest.raises(RobotFault, match="trial a was stopped before its end"):
        robot.run("a", x)
    stop.join()
    assert robot.motion("a").started
    assert robot.motion("a").measurement is None


def test_code_that_raises_is_a_fault_that_names_its_line(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    write_robot(tmp_path, "faulty", ("force = command[0]", 'force = {}["puck"]'))
    robot = RehearsalRobot("rehearsal:faulty", setups.load("faulty"), 0, 0.0, tmp_path)
    with pytest.raises(RobotFault, match=r"trial first failed: KeyError: 'puck', at .*faulty.py:\d+"):
        robot.run("first", np.full(4, 0.5))
    assert robot.motion("first").started
    assert robot.motion("first").measurement is None
