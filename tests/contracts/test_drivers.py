"""What every driver of a robot must obey; the one that the documentation shows how to write is among them."""

import hashlib
import re
import threading
from pathlib import Path

import numpy as np
import pytest

from workers import setups
from workers.environments.environment import Observed
from workers.hardware import robots
from workers.hardware.driver import Measurement, Motion, RobotDriver, RobotFault
from workers.hardware.ledger import FILE, MotionLedger
from workers.hardware.robots import Robot
from workers.randomness import Stream, generator
from workers.rollout import rollout

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "drivers.md"
REHEARSALS = [*sorted(robots.ROBOTS.keys() & setups.SETUPS.keys()), "rehearsal:quadratic-30d"]
"""Robots that are setups too are simulated; a test that connected another would move it."""

SEED = 3
PUSHED = 0.125
"""Metres by which the arm that moves nothing says it has pushed the first roll."""


def still(_x, _stopped):
    """Plays no motion: what is seen is an upright roll that ends where a good push would leave it."""
    setup = setups.load("franka")
    task = setup.task
    xi = np.zeros((len(setup.observation), setup.horizon), np.float32)
    for number, (at_x, at_y) in enumerate(task.starts):
        roll = xi[task.channel + 9 * number :]
        roll[0], roll[1], roll[3], roll[7] = at_x, at_y, 1.0, 1.0
    xi[task.channel + 1, -1] += task.direction * PUSHED
    middle = np.array([np.mean(task.table_x), np.mean(task.table_y), 0.2])
    hand = np.repeat(middle[:, None], setup.horizon, axis=1)
    touching = np.zeros(setup.horizon, bool)
    return Observed(xi, {"hand_position": hand, "table_contact": touching})


def documented(play) -> Robot:
    """The robot of the page, whose two blocks are executed as they stand there."""
    section = PAGE.read_text().partition("## A driver for a real robot")[2].partition("\n## ")[0]
    module, entry = re.findall(r"```python\n(.*?)```", section, re.DOTALL)
    namespace = {"Robot": Robot, "play": play}
    exec(module, namespace)
    return eval(entry, namespace)


@pytest.fixture(scope="module", params=[*REHEARSALS, "lab-arm"])
def robot(request):
    return robots.find(request.param) if request.param in REHEARSALS else documented(still)


@pytest.fixture(scope="module")
def x(robot):
    return generator(0, Stream.CONTROLLER, 0).random(setups.load(robot.setup).dimensions)


@pytest.fixture(scope="module")
def ran(robot, x, tmp_path_factory):
    """The folder of a robot that has run the trial "a", and what it measured."""
    folder = tmp_path_factory.mktemp("ran")
    return folder, robot.connect(SEED, 0.0, folder).run("a", x)


def motions(folder):
    return [(entry["trial"], entry["event"]) for entry in MotionLedger(folder / FILE).entries()]


def test_a_driver_has_the_name_and_the_setup_of_its_robot(robot, tmp_path):
    driver = robot.connect(SEED, 0.0, tmp_path)
    assert isinstance(driver, RobotDriver)
    assert (driver.name, driver.setup) == (robot.name, robot.setup)


def test_the_robot_knows_what_became_of_a_trial_whatever_process_asks(robot, ran):
    folder, measured = ran
    assert isinstance(measured, Measurement)
    driver = robot.connect(SEED, 0.0, folder)
    assert driver.motion("a") == Motion(started=True, measurement=measured)
    assert driver.motion("b") == Motion(started=False, measurement=None)


@pytest.mark.parametrize("robot", REHEARSALS, indirect=True, scope="module")
def test_a_rehearsal_moves_as_the_setup_of_its_own_name(robot, x, ran):
    setup = setups.load(robot.name.removeprefix(robots.REHEARSAL))
    physics = setup.gap("wide").draw(generator(SEED, Stream.HIDDEN_PHYSICS, 0))
    with setup.open() as environment:
        episode = rollout(setup, environment, x.astype(np.float32), physics)
    measured = ran[1]
    assert (measured.f, measured.y, measured.stop) == (episode.f, episode.y, episode.stop)
    assert measured.evidence == hashlib.sha256(episode.xi.tobytes()).hexdigest()


def test_no_trial_moves_the_robot_twice_even_in_another_process(robot, x, ran):
    with pytest.raises(RuntimeError, match="trial a has already moved the robot"):
        robot.connect(SEED, 0.0, ran[0]).run("a", x)
    assert motions(ran[0]) == [("a", "started"), ("a", "ended")]


def test_a_stopped_robot_starts_nothing(robot, x, tmp_path):
    driver = robot.connect(SEED, 0.0, tmp_path)
    driver.stop()
    with pytest.raises(RobotFault, match="trial a was not started"):
        driver.run("a", x)
    assert motions(tmp_path) == []


@pytest.mark.parametrize("spoil", [lambda x: x + 2.0, lambda x: x[1:], lambda x: x * np.nan], ids=range(3))
def test_a_controller_outside_the_cube_moves_nothing(robot, x, spoil, tmp_path):
    with pytest.raises(ValueError, match="x"):
        robot.connect(SEED, 0.0, tmp_path).run("a", spoil(x))
    assert motions(tmp_path) == []


def test_the_documented_driver_measures_what_the_task_says_of_the_motion(tmp_path):
    robot = documented(still)
    measured = robot.connect(SEED, 0.0, tmp_path).run("a", np.full(48, 0.5))
    assert (robot.name, measured.y, measured.stop) == ("lab-arm", 0.0, "")
    assert measured.f == pytest.approx(PUSHED, abs=1e-6)


def test_the_documented_driver_writes_the_trial_down_before_it_moves(tmp_path):
    seen = []

    def watched(x, stopped):
        seen.extend(motions(tmp_path))
        return still(x, stopped)

    documented(watched).connect(SEED, 0.0, tmp_path).run("a", np.full(48, 0.5))
    assert seen == [("a", "started")]


def test_a_stop_and_a_break_off_of_the_documented_driver_are_faults_without_measurement(tmp_path):
    def broken(_x, _stopped):
        raise OSError("joint 3 is hot")

    def waiting(x, stopped):
        moving.set()
        assert stopped.wait(timeout=60)
        return still(x, stopped)

    def stop():
        assert moving.wait(timeout=60)
        driver.stop()

    with pytest.raises(RobotFault, match="trial a broke off: joint 3 is hot"):
        documented(broken).connect(SEED, 0.0, tmp_path).run("a", np.full(48, 0.5))
    moving, driver = threading.Event(), documented(waiting).connect(SEED, 0.0, tmp_path)
    stopping = threading.Thread(target=stop)
    stopping.start()
    with pytest.raises(RobotFault, match="trial b was stopped before its end"):
        driver.run("b", np.full(48, 0.5))
    stopping.join()
    assert motions(tmp_path) == [("a", "started"), ("b", "started")]
