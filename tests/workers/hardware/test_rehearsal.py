"""The rehearsal robot, its ledger and the registry of robots."""

import hashlib
import json
import threading

import numpy as np
import pytest

from workers import setups
from workers.hardware import robots
from workers.hardware.driver import Measurement, RobotFault
from workers.hardware.ledger import MotionLedger
from workers.hardware.rehearsal import RehearsalRobot
from workers.randomness import Stream, generator
from workers.rollout import rollout

EVIDENCE = "ab" * 32
FRANKA = "franka-rehearsal"


@pytest.fixture(scope="module")
def franka():
    return setups.load("franka")


@pytest.fixture(scope="module")
def x(franka):
    return generator(0, Stream.CONTROLLER, 0).random(franka.dimensions)


def test_an_unknown_robot_is_refused_with_the_nearest_name():
    with pytest.raises(
        LookupError, match=r"unknown robot 'franka-rehersal'.*did you mean 'franka-rehearsal'\?"
    ):
        robots.find("franka-rehersal")


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
