"""Robots by name: those that ship, the rehearsal of any setup, those of packages, and a user's own."""

import sys

import numpy as np
import pytest

from tests.packages import install
from workers.hardware import robots
from workers.hardware.driver import RobotFault
from workers.hardware.rehearsal import RehearsalMachine
from workers.hardware.robots import Robot
from workers.host.home import RobotHome
from workers.host.limits import RobotLimits
from workers.randomness import Stream, generator

SOURCE = '''
"""The robots of a lab."""
from dataclasses import replace
from workers import setups
from workers.hardware.robots import Robot
from workers.physics import around

class Arm:
    def __init__(self):
        raise OSError("no cable")

ARM = Robot("arm", "lab_robots:puck", "lab_robots:Arm")

def arm():
    """The arm, when it is asked for."""
    return ARM

def broken():
    return 1 / 0

def puck():
    mass = around({"mass": 2.0}, 0.5)
    return replace(setups.load("quadratic-30d"), physics=mass, gaps={"paper": mass, "wide": mass})

def narrow():
    return replace(puck(), gaps={"paper": puck().physics})
'''


@pytest.fixture
def lab(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    offers = {"lab-arm": "lab_robots:arm", "yumi-rehearsal": "lab_robots:arm"}
    install(tmp_path, "lab-robots", {"svaedc.robots": offers}, lab_robots=SOURCE)
    yield tmp_path
    sys.modules.pop("lab_robots", None)


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize("name", ["lab-arm", "lab_robots:ARM", "lab_robots:arm"])
def test_a_robot_of_a_package_or_a_module_is_known_by_the_name_that_was_asked_for(name, tmp_path):
    robot = robots.find(name)
    assert (robot.name, robot.setup, robot.simulated) == (name, "lab_robots:puck", False)
    driver = robot.connect(0, 0.0, RobotHome(tmp_path / "home", name).make(), RobotLimits())
    assert (driver.name, driver.setup) == (name, "lab_robots:puck")
    with pytest.raises(RobotFault, match=r"does not start: OSError: no cable"):
        driver.check("a", np.full(30, 0.5))


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("franka-rehersal", r"unknown robot 'franka-rehersal'; did you mean 'franka-rehearsal'\?"),
        ("lab-am", "did you mean 'lab-arm'"),
        ("lab_robots:AMR", "module 'lab_robots' has no 'AMR'; did you mean 'ARM'"),
        (
            "lab_robots:broken",
            r"lab_robots:broken failed with ZeroDivisionError: .*lab_robots\.py:19",
        ),
        ("lab_robots:puck", r"must be a workers\.hardware\.robots\.Robot or a function .* got Setup"),
        ("rehearsal:frnka", "unknown setup 'frnka'; did you mean 'franka'"),
        (
            "rehearsal:lab_robots:narrow",
            r"draws its hidden physics from the gap 'wide', which the setup 'lab_robots:narrow' does not "
            r"have \(it has paper\)",
        ),
    ],
)
def test_what_is_no_robot_is_refused_with_the_reason(name, message):
    with pytest.raises(LookupError, match=message):
        robots.find(name)


@pytest.mark.usefixtures("lab")
def test_a_name_that_ships_stays_what_it_is_whatever_packages_offer():
    assert robots.find("yumi-rehearsal") is robots.ROBOTS["yumi-rehearsal"]


@pytest.mark.usefixtures("lab")
@pytest.mark.parametrize("setup", ["quadratic-30d", "lab_robots:puck"])
def test_any_setup_is_rehearsed_by_itself_and_said_to_be_simulated(setup, tmp_path):
    robot = robots.find(f"rehearsal:{setup}")
    assert robot.simulated
    driver = robot.connect(3, 0.0, RobotHome(tmp_path / "home", robot.name).make(), RobotLimits())
    assert (driver.name, driver.setup) == (robot.name, robot.setup) == (f"rehearsal:{setup}", setup)
    x = np.full(30, 0.5)
    assert driver.run("a", x).f == pytest.approx(30 * 1.5**2)
    driver.stop()


@pytest.mark.usefixtures("lab")
def test_the_hidden_physics_of_a_rehearsal_is_drawn_once_from_the_wide_gap():
    machine = RehearsalMachine("lab_robots:puck", "lab_robots:puck", 3)
    mass = generator(3, Stream.HIDDEN_PHYSICS, 0).uniform(1.0, 3.0)
    assert machine._physics == {"mass": mass}


def test_of_robots_that_ship_all_are_simulated_and_one_that_does_not_say_so_is_real():
    assert all(robot.simulated for robot in robots.ROBOTS.values())
    assert not Robot("arm", "franka", "lab:Arm").simulated
