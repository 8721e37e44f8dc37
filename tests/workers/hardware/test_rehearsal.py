"""The rehearsal robot: the setup under hidden physics, in its host, at a robot's pace."""

import hashlib

import numpy as np
import pytest

from tests.own_robot import write_robot
from workers import setups
from workers.hardware import robots
from workers.hardware.driver import RobotFault
from workers.host.home import RobotHome
from workers.host.limits import RobotLimits
from workers.randomness import Stream, generator
from workers.rollout import rollout

FRANKA = "franka-rehearsal"


@pytest.fixture(scope="module")
def franka():
    return setups.load(FRANKA)


@pytest.fixture(scope="module")
def x(franka):
    return generator(0, Stream.CONTROLLER, 0).random(franka.dimensions)


@pytest.fixture
def rehearsal(tmp_path):
    """(name, seed, pace, limits) -> the robot; its host ends with the test."""
    made = []

    def connect(name=FRANKA, seed=5, pace=0.0, limits=None):
        home = RobotHome(tmp_path / "home", name).make()
        made.append(robots.find(name).connect(seed, pace, home, RobotLimits.read(limits or {}, "limits")))
        return made[-1]

    yield connect
    for robot in made:
        robot.stop()


@pytest.mark.parametrize("name", sorted(robots.ROBOTS))
def test_a_rehearsal_measures_the_setup_under_the_hidden_physics_of_its_seed(rehearsal, name):
    setup = setups.load(name)
    x = generator(0, Stream.CONTROLLER, 1).random(setup.dimensions)
    measured = rehearsal(name).run("a", x)
    physics = setup.gap("wide").draw(generator(5, Stream.HIDDEN_PHYSICS, 0))
    with setup.open() as environment:
        episode = rollout(setup, environment, x.astype(np.float32), physics)
    assert (measured.f, measured.y, measured.stop) == (episode.f, episode.y, episode.stop)
    assert measured.evidence == hashlib.sha256(episode.xi.tobytes()).hexdigest()


def test_two_trials_of_one_controller_measure_the_same_and_another_seed_another(rehearsal, x):
    robot = rehearsal()
    first, second, third = robot.run("a", x), robot.run("b", x), rehearsal(seed=6).run("c", x)
    assert first.evidence == second.evidence != third.evidence


def test_a_trial_takes_at_least_its_pace(rehearsal, x):
    assert rehearsal(pace=1.5).run("a", x).seconds >= 1.4


@pytest.mark.parametrize("pace", [-1.0, 1e10, float("inf"), float("nan")])
def test_a_pace_that_nothing_can_wait_for_is_refused(rehearsal, pace):
    with pytest.raises(ValueError, match=r"pace must lie in \[0, 86400\] s, got"):
        rehearsal(pace=pace)


def test_what_a_controller_wants_is_told_in_physical_units_before_it_moves(rehearsal, x):
    planned = rehearsal().check("a", x)
    by_name = {channel["name"]: channel for channel in planned.channels}
    assert (planned.steps, planned.seconds, planned.objection) == (500, 1.0, "")
    assert (by_name["hand_z"]["kind"], by_name["hand_z"]["unit"]) == ("workspace", "m")
    assert by_name["hand_x"]["low"] <= by_name["hand_x"]["high"]
    low = by_name["hand_x"]["low"]
    beyond = rehearsal(limits={"workspace": {"hand_x": [low + 0.01, 2.0]}}).check("b", x).objection
    assert "the workspace of hand_x must lie in" in beyond


def test_torques_beyond_the_limits_stop_a_motion_and_are_never_clipped(rehearsal, x):
    robot = rehearsal(limits={"torque": {"*": 0.01}})
    with pytest.raises(RobotFault, match=r"trial a: step \d+: the torque of .* must lie in \[-0.01, 0.01\]"):
        robot.run("a", x)
    assert robot.motion("a").measurement is None


def test_code_that_raises_is_a_fault_that_names_its_line(rehearsal, tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)
    write_robot(tmp_path, "faulty", ("force = command[0]", 'force = {}["puck"]'))
    robot = rehearsal("rehearsal:faulty")
    with pytest.raises(RobotFault, match=r"trial first: KeyError: 'puck', at .*faulty.py:\d+"):
        robot.run("first", np.full(4, 0.5))
    assert robot.motion("first").started
    assert robot.motion("first").measurement is None
