"""The planned motion of the hand, against closed forms and scipy's rotations."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from workers.controllers.reference import (
    angular_velocity,
    ends,
    euler_angles,
    minimum_jerk,
    quaternions,
    reference,
)

angles = st.floats(-1.5, 1.5)
turns = st.floats(-3.1, 3.1)
DT = 0.002


def _motion(steps: int = 4000, duration: float = 0.4):
    s = np.linspace(0, 1, steps + 1)[:, None]
    a, b = np.array([[0.2, -0.3, 0.1]]), np.array([[0.6, 0.4, 0.25]])
    return s * duration, a, b, minimum_jerk(s, a, b, np.array([[duration]]))


def test_minimum_jerk_starts_and_ends_at_rest_without_acceleration():
    _, a, b, (position, velocity, acceleration) = _motion()
    assert position[[0, -1]] == pytest.approx(np.vstack([a, b]), abs=1e-12)
    assert velocity[[0, -1]] == pytest.approx(0.0, abs=1e-12)
    assert acceleration[[0, -1]] == pytest.approx(0.0, abs=1e-10)


def test_minimum_jerk_velocity_and_acceleration_are_derivatives_of_the_position():
    time, _, _, (position, velocity, acceleration) = _motion()
    inner = slice(2, -2)
    assert np.gradient(position, time[:, 0], axis=0)[inner] == pytest.approx(velocity[inner], abs=1e-5)
    assert np.gradient(velocity, time[:, 0], axis=0)[inner] == pytest.approx(acceleration[inner], abs=1e-3)


def test_minimum_jerk_peaks_half_way_at_fifteen_eighths_of_the_mean_speed():
    _, a, b, (_, velocity, _) = _motion()
    assert velocity[2000] == pytest.approx((15 / 8 * (b - a) / 0.4)[0])


@given(turns, angles, turns)
def test_quaternions_equal_those_of_scipy(roll, pitch, yaw):
    expected = Rotation.from_euler("xyz", [roll, pitch, yaw]).as_quat()
    ours = quaternions(np.array([[roll, pitch, yaw]]))[0]
    assert abs(ours @ expected) == pytest.approx(1.0, abs=1e-12)


@given(turns, angles, turns)
def test_euler_angles_survive_the_round_trip(roll, pitch, yaw):
    back = euler_angles(quaternions(np.array([[roll, pitch, yaw]]))[0])
    assert back == pytest.approx([roll, pitch, yaw], abs=1e-7)


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_angular_velocity_of_a_steady_turn_is_its_rate(spin):
    times = np.arange(20) * DT
    start = Rotation.from_euler("xyz", [0.4, -0.3, 2.0])
    turning = Rotation.from_rotvec(times[:, None] * np.array(spin)) * start
    found = angular_velocity(turning.as_quat(canonical=True), DT)
    assert found[1:-1] == pytest.approx(np.tile(spin, (18, 1)), abs=1e-4)


def test_the_reference_passes_every_waypoint_at_its_step():
    rng = np.random.default_rng(0)
    corners, orientations = rng.normal(size=(7, 3)), rng.uniform(-1, 1, (7, 3))
    position, velocity, acceleration, orientation, _ = reference(corners, orientations, 500, DT)
    reached = ends(500, 6)
    assert reached[0] == 0
    assert reached[-1] == 500
    at = reached[1:] - 1
    assert position[at] == pytest.approx(corners[1:], abs=1e-12)
    assert velocity[at] == pytest.approx(0.0, abs=1e-9)
    assert acceleration[at] == pytest.approx(0.0, abs=1e-7)
    assert orientation[at] == pytest.approx(quaternions(orientations[1:]), abs=1e-12)


def test_the_reference_moves_without_jumps():
    rng = np.random.default_rng(1)
    corners, orientations = rng.normal(size=(7, 3)), rng.uniform(-1, 1, (7, 3))
    position, velocity, *_, orientation, spin = reference(corners, orientations, 500, DT)
    largest = np.abs(velocity).max() * DT
    assert np.abs(np.diff(position, axis=0)).max() <= 1.01 * largest
    assert np.einsum("td,td->t", orientation[1:], orientation[:-1]).min() > 0.99
    assert np.isfinite(spin).all()
