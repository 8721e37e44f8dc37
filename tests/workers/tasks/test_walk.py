"""Walking: bad conditions and objective of hand-made trajectories."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from workers.environments.environment import Observed
from workers.tasks.walk import Walk, roll_and_pitch

STEPS = 4
TASK = Walk(channel=18)


def _observed(
    *, position=(0.0, 0.0, 0.3), euler=(0.0, 0.0, 0.0), speeds=(0.0,) * STEPS, elbow=False
) -> Observed:
    """A robot that keeps one pose; `speeds` are those of its eighth joint."""
    xi = np.zeros((27, STEPS), dtype=np.float32)
    xi[18:21] = np.array(position)[:, None]
    matrix = Rotation.from_euler("xyz", euler, degrees=True).as_matrix()
    xi[21:] = matrix[:, :2].T.reshape(6, 1)
    joint_speeds = np.zeros((18, STEPS))
    joint_speeds[7] = speeds
    return Observed(xi=xi, signals={"joint_speeds": joint_speeds, "elbow_contact": np.full(STEPS, elbow)})


def _conditions(**scene) -> set[str]:
    bad = TASK.is_bad(_observed(**scene))
    return {name for name, row in zip(TASK.conditions, bad, strict=True) if row.all()}


def test_a_robot_that_stands_is_not_bad():
    assert not TASK.is_bad(_observed()).any()


@pytest.mark.parametrize(
    ("scene", "condition"),
    [
        ({"speeds": (10.1,) * STEPS}, "joint_speed"),
        ({"speeds": (-10.1,) * STEPS}, "joint_speed"),
        ({"euler": (61, 0, 0)}, "tilt"),
        ({"euler": (-61, 0, 0)}, "tilt"),
        ({"euler": (0, 61, 0)}, "tilt"),
        ({"euler": (0, -61, 0)}, "tilt"),
        ({"euler": (180, 0, 0)}, "tilt"),
        ({"elbow": True}, "elbow_contact"),
        ({"position": (0, 0, 0.09)}, "height"),
        ({"position": (0, 0, 0.71)}, "height"),
        ({"position": (0.51, 0, 0.3)}, "corridor"),
        ({"position": (-0.51, 0, 0.3)}, "corridor"),
    ],
)
def test_each_condition_has_its_own_bit(scene, condition):
    assert _conditions(**scene) == {condition}


@pytest.mark.parametrize(
    "scene",
    [
        {"speeds": (9.9, -9.9, 9.9, -9.9)},
        {"euler": (59, 0, 0)},
        {"euler": (0, -59, 0)},
        {"euler": (0, 0, 170)},
        {"position": (0, 5, 0.11)},
        {"position": (0, -5, 0.69)},
        {"position": (0.49, 0, 0.3)},
    ],
)
def test_what_is_just_allowed_is_not_bad(scene):
    assert _conditions(**scene) == set()


@given(st.floats(-179, 179), st.floats(-89, 89), st.floats(-179, 179))
def test_roll_and_pitch_are_those_of_scipy(roll, pitch, yaw):
    matrix = Rotation.from_euler("xyz", (roll, pitch, yaw), degrees=True).as_matrix()
    found = roll_and_pitch(matrix[:, :2].T.reshape(6, 1))
    assert np.degrees(found).ravel() == pytest.approx((roll, pitch), abs=1e-4)


def _objective(observed: Observed) -> float:
    return TASK.objective(observed, TASK.is_bad(observed))


@given(st.floats(-10, 10, width=32))
def test_the_objective_is_ten_times_the_metres_walked_forward(y):
    assert _objective(_observed(position=(0.2, y, 0.3))) == pytest.approx(10 * y, abs=1e-6)


def test_every_step_with_a_fast_joint_costs_one():
    fast = _observed(position=(0, 2, 0.3), speeds=(0, 11, -12, 9))
    assert _objective(fast) == pytest.approx(20 - 2)


def test_other_bad_steps_cost_nothing():
    assert _objective(_observed(position=(3, 2, 0.05), euler=(170, 0, 0), elbow=True)) == pytest.approx(20)


def test_heights_in_the_wrong_order_are_refused():
    with pytest.raises(ValueError, match="height must be"):
        Walk(channel=18, height=(0.7, 0.1))
