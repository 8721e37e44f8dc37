"""The rehearsal robot, its ledger and the registry of robots."""

import hashlib
import json
import threading

import numpy as np
import pytest

from workers import setups
from workers.hardware import robots
from workers.hardware.driver import Measurement, RobotDriver, RobotFault
from workers.hardware.ledger import MotionLedger
from workers.hardware.rehearsal import RehearsalRobot
from workers.randomness import generator
from workers.rollout import rollout

EVIDENCE = "ab" * 32
FRANKA = "franka-rehearsal"


@pytest.fixture(scope="module")
def franka():
    return setups.load("franka")


@pytest.fixture(scope="module")
def x(franka):
    return generator(0, "controller", 0).random(franka.dimensions)


@pytest.mark.parametrize("setup", ["franka", "yumi", "daisy-11d"])
def test_a_robot_is_found_by_name_and_names_its_setup(setup, tmp_path):
    robot = robots.find(f"{setup}-rehearsal")
    driver = robot.connect(0, 0.0, tmp_path)
    assert isinstance(driver, RobotDriver)
    assert (driver.name, driver.setup) == (robot.name, robot.setup) == (f"{setup}-rehearsal", setup)


@pytest.mark.parametrize("name", sorted(robots.ROBOTS))
def test_a_robot_moves_as_the_setup_of_its_own_name(name, tmp_path):
    setup = setups.load(name)
    x = generator(0, "controller", 1).random(setup.dimensions, dtype=np.float32)
    with setup.open() as environment:
        episode = rollout(setup, environment, x, setup.gap("wide").draw(generator(3, "hidden-physics", 0)))
    measured = robots.find(name).connect(3, 0.0, tmp_path).run("a", x)
    assert (measured.f, measured.y, measured.stop) == (episode.f, episode.y, episode.stop)
    assert measured.evidence == hashlib.sha256(episode.xi.tobytes()).hexdigest()


def test_an_unknown_robot_is_refused_with_the_nearest_name():
    with pytest.raises(
        LookupError, match=r"unknown robot 'franka-rehersal'.*did you mean 'franka-rehearsal'\?"
    ):
        robots.find("franka-rehersal")


def test_a_rehearsal_measures_the_setup_under_the_hidden_physics_of_its_seed(franka, x, tmp_path):
    measured = RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path).run("a", x)
    physics = franka.gap("wide").draw(generator(5, "hidden-physics", 0))
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


def test_a_negative_pace_is_refused(franka, tmp_path):
    with pytest.raises(ValueError, match=r"pace must be at least 0 s, got -1"):
        RehearsalRobot(FRANKA, franka, 5, -1.0, tmp_path)


def test_no_trial_moves_the_robot_twice_even_in_another_process(franka, x, tmp_path):
    RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path).run("a", x)
    with pytest.raises(RuntimeError, match="trial a has already moved the robot"):
        RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path).run("a", x)
    assert [entry["event"] for entry in MotionLedger(tmp_path / "starts.jsonl").entries()] == [
        "started",
        "ended",
    ]


def test_the_robot_knows_what_became_of_a_trial(franka, x, tmp_path):
    robot = RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path)
    assert not robot.motion("a").started
    measured = robot.run("a", x)
    assert robot.motion("a").measurement == measured


def test_a_stop_in_motion_is_a_fault_without_measurement(franka, x, tmp_path):
    robot = RehearsalRobot(FRANKA, franka, 5, 60.0, tmp_path)
    stop = threading.Timer(0.5, robot.stop)
    stop.start()
    with pytest.raises(RobotFault, match="trial a was stopped before its end"):
        robot.run("a", x)
    stop.join()
    assert robot.motion("a").started
    assert robot.motion("a").measurement is None


def test_a_stopped_robot_starts_nothing(franka, x, tmp_path):
    robot = RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path)
    robot.stop()
    with pytest.raises(RobotFault, match="was not started"):
        robot.run("a", x)
    assert not robot.motion("a").started


def test_a_controller_outside_the_cube_moves_nothing(franka, tmp_path):
    robot = RehearsalRobot(FRANKA, franka, 5, 0.0, tmp_path)
    with pytest.raises(ValueError, match="2"):
        robot.run("a", np.full(franka.dimensions, 2.0))
    assert not robot.motion("a").started


@pytest.mark.parametrize("torn", [b'{"event": "star', b'{"event": "started", "trial"', b"\xff\xfe", b"17"])
def test_a_torn_last_line_never_happened_and_hurts_no_later_one(tmp_path, torn):
    ledger = MotionLedger(tmp_path / "starts.jsonl")
    ledger.start("a", np.zeros(2))
    with ledger.path.open("ab") as file:
        file.write(torn)
    ledger.start("b", np.zeros(2))
    assert [entry["trial"] for entry in ledger.entries()] == ["a", "b"]
    assert ledger.motion("b").started


def test_the_ledger_is_lines_of_json_that_name_the_controller(tmp_path):
    ledger = MotionLedger(tmp_path / "starts.jsonl")
    x = np.array([0.25, 0.5])
    ledger.start("a", x)
    ledger.end("a", Measurement(0.5, 0.25, "", 1.0, EVIDENCE))
    started, ended = (json.loads(line) for line in ledger.path.read_text().splitlines())
    assert started["x"] == hashlib.sha256(x.tobytes()).hexdigest()
    assert Measurement(**ended["measurement"]) == Measurement(0.5, 0.25, "", 1.0, EVIDENCE)


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("f", float("nan"), "objective f must be finite, got nan"),
        ("y", 1.5, r"badness y must lie in \[0, 1\], got 1.5"),
        ("y", float("nan"), r"badness y must lie in \[0, 1\], got nan"),
        ("seconds", -1.0, "seconds must be finite and at least 0, got -1.0"),
        ("evidence", "abc", "evidence must be a SHA-256 in hexadecimal, got 'abc'"),
    ],
)
def test_an_impossible_measurement_is_refused(field, value, message):
    good = {"f": 0.5, "y": 0.25, "stop": "", "seconds": 1.0, "evidence": EVIDENCE}
    with pytest.raises(ValueError, match=message):
        Measurement(**(good | {field: value}))
