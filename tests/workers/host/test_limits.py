"""RobotLimits hold for plans and commands, and reject whatever they do not know to be allowed."""

import math
import random
import re

import pytest

from workers.host.limits import HostChannel, LimitWatch, RobotLimits, first_objection
from workers.host.machine import Plan

JOINTS = (HostChannel("hip", "position", "rad"), HostChannel("knee", "position", "rad"))
LIMITS = RobotLimits.read(
    {
        "position": {"*": [-1.0, 1.0], "knee": [0.0, 0.5]},
        "speed": {"*": 2.0},
        "acceleration": {"hip": 50.0},
        "torque": {"*": 5},
        "workspace": {"hand_z": [0.1, 0.8]},
        "duration": 20,
        "rest": 30,
        "trials_per_hour": 3,
        "trials_per_day": 5,
    },
    "limits.toml",
)


@pytest.mark.parametrize(
    ("rows", "named"),
    [
        ([[0.0, 0.2], [0.01, 0.21], [0.02, 0.22]], ""),
        ([[0.0, 0.2], [1.2, 0.2]], r"step 1: the position of hip must lie in \[-1, 1\], got 1.2"),
        ([[0.0, 0.6]], r"step 0: the position of knee must lie in \[0, 0.5\], got 0.6"),
        ([[0.0, 0.2], [0.0, 0.23]], r"step 1: the speed of knee must lie in \[-2, 2\], got 3"),
        ([[0.0, 0.2], [0.01, 0.2], [0.0, 0.2]], r"step 2: the acceleration of hip .* got -200"),
        ([[0.0]], "step 0: a command must have 2 values, got 1"),
        ([[0.0, math.nan]], "step 0: knee must be a finite number, got nan"),
        ([[math.inf, 0.2]], "step 0: hip must be a finite number, got inf"),
        ([["0.1", 0.2]], "step 0: hip must be a finite number, got '0.1'"),
        ([[True, 0.2]], "step 0: hip must be a finite number, got True"),
    ],
)
def test_positions_their_speeds_and_accelerations(rows, named):
    found = first_objection(LimitWatch(LIMITS, JOINTS, 0.01), rows)
    assert re.fullmatch(named, found)


@pytest.mark.parametrize(
    ("channel", "rows", "named"),
    [
        (HostChannel("hip", "speed", "rad/s"), [[2.1]], "the speed of hip"),
        (HostChannel("hip", "speed", "rad/s"), [[0.0], [0.6]], "the acceleration of hip"),
        (HostChannel("hip", "torque", "N·m"), [[-5.5]], "the torque of hip"),
        (HostChannel("hand_z", "workspace", "m"), [[0.05]], "the workspace of hand_z"),
        (HostChannel("hand_x", "workspace", "m"), [[9.0]], ""),
        (HostChannel("gain", "", "N/m"), [[1e9]], ""),
    ],
)
def test_speeds_torques_and_the_workspace(channel, rows, named):
    found = first_objection(LimitWatch(LIMITS, [channel], 0.01), rows)
    assert named in found
    assert bool(named) == bool(found)


@pytest.mark.parametrize("times", [500, pytest.param(10_000, marks=pytest.mark.slow)])
def test_whatever_passes_lies_within_the_limits(times):
    rng, passed = random.Random(times), 0
    odd = [math.nan, math.inf, -math.inf, 1e308, -0.0, 5e-324, 1.0, 1.0000001, 0.5, 0.5000001]
    for _ in range(times):
        spread = rng.choice([0.001, 0.01, 0.1, 1.0])
        row, rows = [0.0, 0.25], []
        for _ in range(rng.randrange(1, 12)):
            row = [rng.choice(odd) if rng.random() < 0.02 else v + rng.gauss(0, spread) for v in row]
            rows.append(row)
        if first_objection(LimitWatch(LIMITS, JOINTS, 0.01), rows):
            continue
        passed += 1
        for number, (hip, knee) in enumerate(rows):
            assert abs(hip) <= 1.0
            assert 0.0 <= knee <= 0.5
            if number:
                assert max(abs(a - b) for a, b in zip(rows[number], rows[number - 1], strict=True)) <= 0.0201
    assert passed > times / 20


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"velocity": {}}, "'velocity' is no limit; there are position, speed"),
        ({"speed": 2.0}, "speed must be a table of limits by joint, got 2.0"),
        ({"speed": {"hip": -1}}, "speed of hip must be a number above 0, got -1"),
        ({"speed": {"hip": True}}, "speed of hip must be a number above 0, got True"),
        ({"position": {"hip": 1.0}}, r"position of hip must be two numbers \[low, high\], got 1.0"),
        ({"position": {"hip": [1.0, -1.0]}}, r"position of hip must have low < high"),
        ({"position": {"hip": [0.0, math.inf]}}, "position of hip must be two numbers"),
        ({"duration": 0}, "duration must be a number above 0, got 0"),
        ({"rest": "long"}, "rest must be a number above 0, got 'long'"),
    ],
)
def test_what_is_no_limit_is_refused_with_its_name(values, named):
    with pytest.raises(ValueError, match=f"limits.toml: {named}"):
        RobotLimits.read(values, "limits.toml")


def test_limits_are_told_apart_by_their_values_and_come_back_from_plain_ones():
    assert RobotLimits.read(LIMITS.facts(), "again") == LIMITS
    assert RobotLimits.read({**LIMITS.facts(), "rest": 31}, "other").sha256 != LIMITS.sha256
    assert RobotLimits().facts() == {}


def test_rest_and_trials_of_an_hour_and_a_day_are_waited_for():
    assert LIMITS.wait_seconds([], 1000.0) == 0
    assert LIMITS.wait_seconds([990.0], 1000.0) == 20
    assert LIMITS.wait_seconds([0.0, 40.0, 80.0], 200.0) == 3400
    assert LIMITS.wait_seconds([0.0, 4000.0, 8000.0, 12000.0, 16000.0], 20000.0) == 66_400
    assert LIMITS.wait_seconds([2000.0], 1000.0) == 1030  # the clock was set back
    assert RobotLimits().wait_seconds([999.9], 1000.0) == 0


def test_extremes_are_told_by_channel_with_speeds_and_margins():
    plan = Plan(JOINTS, 0.1, [[0.0, 0.2], [-0.5, 0.4], [-0.4, 0.4]], 0.3)
    hip, knee = plan.extremes(RobotLimits.read({"position": {"knee": [0.0, 1.0]}}, "test"))
    assert (hip["name"], hip["unit"], hip["low"], hip["high"]) == ("hip", "rad", -0.5, 0.0)
    assert (knee["low"], knee["high"]) == (0.2, 0.4)
    assert (hip["fastest"], knee["fastest"]) == pytest.approx((5.0, 2.0))
    assert (hip["margin"], knee["margin"]) == (None, pytest.approx(0.2))
