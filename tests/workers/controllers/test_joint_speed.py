"""The joint-speed waypoints: what is planned, and that nothing leaves the limits."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from workers.controllers.joint_speed import JointSpeedWaypoints, _inwards

LIMITS = (1.0, 2.0)
HORIZON = 120
cubes = arrays(np.float32, 9, elements=st.floats(0, 1, width=32))


@pytest.fixture(scope="module")
def controller() -> JointSpeedWaypoints:
    return JointSpeedWaypoints(
        waypoints=3, joints=("a", "b"), speed_limits=LIMITS, lower=(-0.1, -0.2), upper=(0.1, 0.2)
    )


def _x(speeds, durations) -> np.ndarray:
    """The controller with those speeds, as shares of the limits, and those durations in [0.1, 1]."""
    rows = np.hstack([(np.array(speeds) + 1) / 2, (np.array(durations)[:, None] - 0.1) / 0.9])
    return rows.ravel().astype(np.float32)


def test_each_speed_is_attained_at_the_end_of_its_share(controller):
    speeds = [(0.5, -1.0), (-0.5, 0.0), (1.0, 1.0)]
    plan = controller.plan(_x(speeds, (0.2, 0.4, 0.6)), HORIZON)
    assert plan[[19, 59, 119]] == pytest.approx(np.array(speeds) * LIMITS, abs=1e-5)


def test_halfway_the_speed_is_the_mean_of_both(controller):
    plan = controller.plan(_x([(0.5, -1.0), (-0.5, 0.0), (1.0, 1.0)], (0.5, 0.5, 0.5)), HORIZON)
    assert plan[19] == pytest.approx([0.25, -1.0], abs=1e-5)
    assert plan[59] == pytest.approx([0.0, -1.0], abs=1e-5)


@given(x=cubes)
def test_no_planned_speed_leaves_the_limits(controller, x):
    plan = controller.plan(x, HORIZON)
    assert plan.shape == (HORIZON, 2)
    assert np.all(np.abs(plan) <= LIMITS)


@given(x=cubes)
def test_speeds_change_smoothly_whatever_the_durations(controller, x):
    """Minimum jerk never changes faster than 15/8 of the mean; the shortest share is 0.1 of 2.1."""
    plan = np.vstack([np.zeros(2), controller.plan(x, HORIZON)])
    shortest = HORIZON * 0.1 / 2.1
    assert np.all(np.abs(np.diff(plan, axis=0)) <= 15 / 8 * 2 * np.array(LIMITS) / shortest + 1e-9)


def test_equal_speeds_do_not_depend_on_the_durations(controller):
    speeds = [(0.3, 0.6)] * 3
    plan = controller.plan(_x(speeds, (0.1, 1.0, 0.5)), HORIZON)
    assert plan[10:] == pytest.approx(np.tile([0.3, 1.2], (HORIZON - 10, 1)), abs=1e-5)


@pytest.mark.parametrize(
    ("speed", "angle", "commanded"),
    [
        (0.5, 0.1, 0.0),
        (0.5, 3.0, 0.0),
        (0.5, 0.099, 0.5),
        (0.5, -3.0, 0.5),
        (-0.5, -0.1, 0.0),
        (-0.5, 3.0, -0.5),
    ],
)
def test_a_joint_beyond_a_limit_is_driven_only_inwards(speed, angle, commanded):
    assert _inwards([speed, 1.0], (angle, 0.0), (-0.1, -0.2), (0.1, 0.2)) == [commanded, 1.0]


def test_parameters_are_seven_speeds_and_a_duration_per_waypoint(controller):
    assert [parameter.name for parameter in controller.parameters[2:5]] == [
        "waypoint1_duration",
        "waypoint2_a",
        "waypoint2_b",
    ]
    assert [parameter.unit for parameter in controller.parameters[:3]] == ["rad/s", "rad/s", "1"]
