"""What a module states becomes plain values, or is refused by name."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import torch

from tests.own_robot import write_robot
from workers import plain
from workers.physics import PhysicsRanges, around
from workers.user_code import UserCodeError


@pytest.mark.parametrize(
    "value", [np.float64(0.5), np.float32(0.5), np.array(0.5), torch.tensor(0.5), 0.5], ids=str
)
def test_scalars_of_any_library_become_pythons_numbers(value):
    assert type(plain.finite(value, "success")) is float
    assert plain.finite(value, "success") == 0.5


@pytest.mark.parametrize("value", [np.int64(20), np.uint8(20), 20, 20.0, np.float32(20)], ids=repr)
def test_a_count_may_be_written_in_any_type(value):
    assert type(plain.count(value, "horizon")) is int
    assert plain.count(value, "horizon") == 20


@pytest.mark.parametrize("value", [0, -1, 2.5, True, "20", None, np.inf, np.nan], ids=repr)
def test_a_count_that_is_none_is_refused_by_its_name(value):
    with pytest.raises(UserCodeError, match=r"horizon must be .* got"):
        plain.count(value, "horizon")


@pytest.mark.parametrize("value", [(1, 0), (1, 1), (0,), 3, "ab", (0, np.inf), (None, 1)], ids=repr)
def test_an_interval_that_is_none_is_refused_by_its_name(value):
    with pytest.raises(UserCodeError, match="objective_limits"):
        plain.interval(value, "objective_limits")


@pytest.fixture
def say(tmp_path):
    """What a new process says of expressions: their value, or type and message of their error.

    The tests' own process checks types at run time, which users' processes do not.
    """

    def evaluate(*expressions: str) -> list[str]:
        write_robot(tmp_path, "glider")
        code = (
            "import json, sys\nimport numpy as np\nfrom dataclasses import replace\n"
            "from workers.environments.environment import Channel\n"
            "from workers.physics import PhysicsRanges\n"
            "import glider\nsound = glider.setup()\n"
            "for text in json.load(sys.stdin):\n"
            "    try:\n        print(repr(eval(text)))\n"
            "    except Exception as error:\n        print(f'{type(error).__name__}: {error}')\n"
        )
        done = subprocess.run(
            [sys.executable, "-c", code],
            input=json.dumps(expressions),
            env={"PYTHONPATH": f"{tmp_path}:{Path.cwd()}"},
            capture_output=True,
            text=True,
            encoding="utf-8",
            check=True,
        )
        return done.stdout.splitlines()

    return evaluate


def test_bounds_of_a_channel_must_be_finite_numbers_of_float32(say):
    bounds = ("-np.inf, np.inf", "0, np.inf", "0, np.nan", "-1e39, 1e39", "None, 1", "'0', 1", "False, 1")
    for told in say(*(f"Channel('torque', 'N·m', {pair})" for pair in bounds)):
        assert told.startswith(
            "UserCodeError: bounds of channel torque must be finite numbers that fit float32"
        )
        assert "; give the widest values that a sound episode reaches" in told


def test_bounds_of_a_channel_may_be_scalars_of_numpy(say):
    assert say("Channel(np.str_('angle'), 'rad', np.float32(-1), np.array(1.0))") == [
        "Channel(name='angle', unit='rad', low=-1.0, high=1.0)"
    ]


def test_a_setup_of_numpys_scalars_is_the_same_as_one_of_plain_numbers(say):
    changes = (
        "horizon=np.int64(20)",
        "control_step=np.float64(0.1)",
        "objective_limits=np.array([-2.0, 2.0])",
        "success=np.float32(0.5)",
        "physics=PhysicsRanges({'mass': np.array([0.5, 2.0]), 'wind': (np.float64(-0.2), 0.1)})",
        "observation=list(sound.observation)",
    )
    assert say(*(f"replace(sound, {change}) == sound" for change in changes)) == ["True"] * len(changes)
    assert say("json.dumps(replace(sound, broken=np.float32(-1), success=np.float32(1)).success)") == [
        "'1.0'"
    ]


def test_what_a_setup_must_not_state_is_refused_by_name(say):
    expected = {
        "success=None": "success of glider must be a finite number, got None",
        "success=np.inf": "success of glider must be a finite number, got inf",
        "horizon=0": "horizon of glider must be a whole number of at least 1, got 0",
        "control_step=0": "control_step of glider must be above 0, got 0",
        "objective_limits=(2.0, -2.0)": "objective_limits of glider must satisfy low < high, got [2.0, -2.0]",
        "objective_limits=(0.0, np.inf)": (
            "high of objective_limits of glider must be a finite number, got inf"
        ),
        "broken='never'": "broken of glider must be a finite number, got 'never'",
        "name=''": "the name of a setup must be a text that is not empty, got ''",
        "observation=sound.observation * 2": (
            "the channels of glider must have names that differ, got 'position' twice; rename one"
        ),
        "observation=()": (
            "glider must have at least one channel of ξ and one parameter of its controller, got 0 and 4"
        ),
        "controller=glider.Forces((Channel('force', 'N', -1, 1),) * 2)": (
            "the parameters of glider must have names that differ, got 'force' twice; rename one"
        ),
        "gaps={'paper': PhysicsRanges({'mass': (1.0, 1.0)})}": (
            "gap 'paper' of glider must have a range for every physics parameter of data collection and for "
            "no other; missing or unknown: wind"
        ),
    }
    told = say(*(f"replace(sound, {change})" for change in expected))
    assert told == [f"UserCodeError: {message}" for message in expected.values()]


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ((0.1, -0.2), r"physics range of wind must satisfy low <= high, got \[0.1, -0.2\]"),
        ((0.1, np.nan), "physics range of wind must be two finite numbers"),
        ((0.1, np.inf), "physics range of wind must be two finite numbers"),
    ],
)
def test_a_physics_range_may_be_of_either_sign_but_not_reversed_or_infinite(pair, message):
    assert PhysicsRanges({"wind": (-0.2, -0.1)}).middle()["wind"] == pytest.approx(-0.15)
    assert around({"wind": -0.1}, 0.5).intervals["wind"] == pytest.approx((-0.15, -0.05))
    with pytest.raises(UserCodeError, match=message):
        PhysicsRanges({"wind": pair})


def test_a_gap_below_zero_is_for_what_may_be_below_zero(own_robot):
    setup = own_robot()
    assert setup.gap("wind=-1:1").intervals["wind"] == (-1.0, 1.0)
    with pytest.raises(
        ValueError, match="mass of own_glider is never below 0 in data collection, so a gap's"
    ):
        setup.gap("mass=-1:1")
