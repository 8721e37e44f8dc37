"""What every robot must obey behind its host; the one that the documentation shows how to drive is one."""

import hashlib
import os
import re
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from tests.workers.drivers.hexapod import hexapod
from workers import setups
from workers.hardware import robots
from workers.hardware.driver import Measurement, Motion, RobotDriver, RobotFault, RobotStopped
from workers.hardware.robots import Robot
from workers.host import stop
from workers.host.home import RobotHome
from workers.host.latch import Stop
from workers.host.limits import RobotLimits
from workers.randomness import Stream, generator
from workers.rollout import rollout

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "drivers.md"
REHEARSALS = [*sorted(robots.ROBOTS.keys() & setups.SETUPS.keys()), "rehearsal:quadratic-30d"]
"""Robots that are setups too are simulated; a test that connected another would move it."""
SEED = 3

MAKER = '''
"""Stands in for the maker's module: an arm that moves nothing."""

class BusError(Exception):
    pass

class Bus:
    def __init__(self, port):
        self.port, self.angles, self.writes = port, [], 0

    def write(self, angles):
        self.angles, self.writes = list(angles), self.writes + 1
        if self.port == "hot" and self.writes == 20:
            raise BusError("joint 3 is hot")

    def read(self):
        return self.angles

    def halt(self):
        print("halted")

    def close(self):
        print("closed")
'''


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A folder with the documented driver and its maker's module, and a Python without any library."""
    folder = tmp_path_factory.mktemp("lab")
    driver, _ = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    (folder / "lab_arm.py").write_text(driver)
    (folder / "maker.py").write_text(MAKER)
    bare = folder / "python"
    bare.write_text(f'#!/bin/sh\ncd {folder} && exec {sys.executable} -S -E "$@"\n')
    bare.chmod(0o700)
    return folder


def documented(lab, port="/dev/ttyUSB0") -> Robot:
    """The robot of the page, in an environment of its own."""
    _, entry = re.findall(r"```python\n(.*?)```", PAGE.read_text(), re.DOTALL)
    names: dict = {}
    exec(entry.replace("/opt/lab/bin/python", os.fspath(lab / "python")).replace("/dev/ttyUSB0", port), names)
    return names["ARM"]


@pytest.fixture(scope="module", params=[*REHEARSALS, "lab-arm", pytest.param("hebi", marks=pytest.mark.slow)])
def robot(request):
    if request.param in REHEARSALS:
        return robots.find(request.param)
    if request.param == "hebi":
        return hexapod(request.getfixturevalue("hebi_python"))
    return documented(request.getfixturevalue("lab"))


@pytest.fixture(scope="module")
def x(robot):
    return generator(0, Stream.CONTROLLER, 0).random(setups.load(robot.setup).dimensions)


CONNECTED = []


@pytest.fixture(autouse=True)
def let_go():
    """No host outlives its test."""
    yield
    while CONNECTED:
        CONNECTED.pop().stop()


def connected(robot, folder, limits=None):
    home = RobotHome(folder / "home", robot.name).make()
    CONNECTED.append(
        robot.connect(SEED, 0.0, home, RobotLimits.read({"silence": 60, **(limits or {})}, "limits"))
    )
    return CONNECTED[-1]


@pytest.fixture(scope="module")
def ran(robot, x, tmp_path_factory):
    """The folder of a robot that has run the trial "a", and what it measured."""
    folder = tmp_path_factory.mktemp("ran")
    driver = connected(robot, folder)
    return folder, driver.run("a", x)


def motions(folder):
    entries = RobotHome(folder / "home", "").ledger.entries()
    return [(entry.facts["trial"], entry.event) for entry in entries if "trial" in entry.facts]


def test_a_robot_behind_its_host_is_a_driver_with_its_name_and_setup(robot, tmp_path):
    driver = connected(robot, tmp_path)
    assert isinstance(driver, RobotDriver)
    assert (driver.name, driver.setup) == (robot.name, robot.setup)


def test_the_robot_knows_what_became_of_a_trial_whatever_process_asks(robot, ran):
    folder, measured = ran
    assert isinstance(measured, Measurement)
    known = connected(robot, folder).motion("a")
    assert known.started
    assert (known.measurement.f, known.measurement.evidence) == (measured.f, measured.evidence)
    assert connected(robot, folder).motion("b") == Motion(started=False, measurement=None)


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
    driver = connected(robot, ran[0])
    with pytest.raises(RobotStopped, match="trial a has already moved the robot"):
        driver.run("a", x)
    assert motions(ran[0]) == [("a", "started"), ("a", "ended")]


def test_a_stopped_robot_starts_nothing(robot, x, tmp_path):
    driver = connected(robot, tmp_path)
    stop.request(driver.home, Stop("Ada", "it smells"))
    with pytest.raises(RobotStopped, match=r"stopped by Ada at .*: it smells"):
        driver.run("a", x)
    driver.stop()
    assert motions(tmp_path) == []


@pytest.mark.parametrize("spoil", [lambda x: x + 2.0, lambda x: x * np.nan], ids=range(2))
def test_a_controller_outside_the_cube_moves_nothing(robot, x, spoil, tmp_path):
    driver = connected(robot, tmp_path)
    with pytest.raises(RobotFault, match=r"every parameter of x must lie in \[0, 1\]"):
        driver.run("a", spoil(x))
    driver.stop()
    assert motions(tmp_path) == []


def test_the_documented_driver_plans_measures_and_lets_go_of_the_arm(lab, tmp_path):
    driver, x = connected(documented(lab), tmp_path), np.full(48, 0.5)
    planned = driver.check("a", x)
    assert (planned.steps, planned.seconds, len(planned.channels)) == (200, 2.0, 6)
    measured = driver.run("a", x)
    assert (measured.f, measured.y, measured.stop) == (pytest.approx(6 * 0.25), 0.0, "")
    assert measured.seconds >= 1.9
    assert driver.hello["rest"] == {"stop": "hold", "kill": "hold", "silence": "hold", "disconnect": "drop"}
    driver.stop()
    assert driver.home.log.read_text().splitlines() == ["halted", "closed"]


def test_a_break_off_a_stop_and_a_limit_end_the_documented_driver_without_measurement(lab, tmp_path):
    x = np.full(48, 0.5)
    with pytest.raises(RobotFault, match="trial hot: the bus says joint 3 is hot"):
        connected(documented(lab, "hot"), tmp_path).run("hot", x)
    with pytest.raises(RobotFault, match=r"was not started: step 80: the position of joint1"):
        connected(documented(lab), tmp_path, {"position": {"*": [0.0, 0.1]}}).run("limited", x)
    driver, outcome = connected(documented(lab), tmp_path), []
    driver.check("stopped", x)

    def run():
        with pytest.raises(RobotStopped) as raised:
            driver.run("stopped", x)
        outcome.append(str(raised.value))

    running = threading.Thread(target=run)
    running.start()
    while not driver.motion("stopped").started:
        time.sleep(0.02)
    assert stop.request(driver.home, Stop("Ada", "enough")).reached
    running.join()
    assert "stopped by Ada at" in outcome[0]
    assert motions(tmp_path) == [
        (name, event) for name in ("hot", "stopped") for event in ("started", "broken")
    ]
