"""What the hand should do at every control step: minimum-jerk positions, linear orientations, their rates."""

from typing import Any

import numpy as np
from jaxtyping import Float

from workers.controllers.arrays import constant, namespace


def ends(horizon: int, waypoints: int) -> np.ndarray:
    """Give every waypoint an equal share of the steps.

    Args:
        horizon: T, control steps.
        waypoints: how many are passed.

    Returns:
        Step at which each waypoint is reached, [waypoints + 1], beginning with 0.
    """
    return np.linspace(0, horizon, waypoints + 1).round().astype(int)


def reference(
    corners: Float[np.ndarray, "points 3"], turns: Float[np.ndarray, "points 3"], horizon: int, dt: float
) -> tuple[np.ndarray, ...]:
    """Motion through the corners, each after an equal share of the horizon, from rest to rest.

    Args:
        corners: positions in m, [points, 3], the first of them the start.
        turns: roll, pitch, yaw in rad at each corner, [points, 3].
        horizon: T, control steps.
        dt: s of a control step.

    Returns:
        Position, velocity, acceleration [horizon, 3], orientation as quaternions (x, y, z, w) [horizon, 4],
        and angular velocity [horizon, 3] wanted at the end of every step; SI units, in the world.
    """
    reached = ends(horizon, len(corners) - 1)
    steps = np.diff(reached)
    leg = np.repeat(np.arange(len(steps)), steps)
    s = ((np.arange(1, horizon + 1) - reached[leg]) / steps[leg])[:, None]
    duration = (steps[leg] * dt)[:, None]
    orientation = quaternions(turns[leg] + s * (turns[leg + 1] - turns[leg]))
    return (
        *minimum_jerk(s, corners[leg], corners[leg + 1], duration),
        orientation,
        angular_velocity(orientation, dt),
    )


def rise(s: Any) -> Any:
    """From 0 to 1 without a jerk while s does, 10 s³ − 15 s⁴ + 6 s⁵; an array of NumPy or torch."""
    return 10 * s**3 - 15 * s**4 + 6 * s**5


def rise_rate(s: Any) -> Any:
    """The derivative of `rise`, 30 s² − 60 s³ + 30 s⁴."""
    return 30 * s**2 - 60 * s**3 + 30 * s**4


def minimum_jerk(
    s: Float[np.ndarray, "time 1"],
    a: Float[np.ndarray, "#time d"],
    b: Float[np.ndarray, "#time d"],
    duration: Float[np.ndarray, "#time 1"],
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Evaluate the minimum-jerk motion a → b at the fractions s of its duration.

    Fifth-order polynomial with zero velocity and acceleration at both ends: 10 s³ − 15 s⁴ + 6 s⁵.

    Args:
        s: fractions in [0, 1], [T, 1].
        a: where it begins, [T, d] or [1, d].
        b: where it ends, [T, d] or [1, d].
        duration: of the whole motion, [T, 1] or [1, 1], in any unit of time.

    Returns:
        Position, velocity and acceleration, [T, d] each, in the units of a, b and duration.
    """
    position = a + (b - a) * rise(s)
    velocity = (b - a) * rise_rate(s) / duration
    acceleration = (b - a) * (60 * s - 180 * s**2 + 120 * s**3) / duration**2
    return position, velocity, acceleration


def motion_through(corners: Any, times: np.ndarray) -> tuple[Any, Any]:
    """Minimum-jerk motion of many bodies through their corners, each after an equal share of the episode.

    Args:
        corners: [n, points, d], an array of NumPy or torch.
        times: in parts of the episode, in (0, 1], [S].

    Returns:
        Position and velocity, [n, d, S] each, in the units of `corners`, and of those per episode.
    """
    legs = int(corners.shape[1]) - 1
    s, a, b = _legs_of(corners, times)
    return a + (b - a) * rise(s), (b - a) * rise_rate(s) * legs


def line_through(corners: Any, times: np.ndarray) -> Any:
    """Straight lines through corners, each after an equal share of the episode.

    Args:
        corners: [n, points, d], an array of NumPy or torch.
        times: in parts of the episode, in (0, 1], [S].

    Returns:
        Values, [n, d, S], in the units of `corners`.
    """
    s, a, b = _legs_of(corners, times)
    return a + s * (b - a)


def leg_at(times: np.ndarray, legs: int) -> np.ndarray:
    """The leg, from 0, that each moment is in, where all take equal shares of the episode.

    Args:
        times: in parts of the episode, in (0, 1], [S].
        legs: how many there are.

    Returns:
        Numbers of legs, [S]; the end of one belongs to it.
    """
    return np.minimum((times * legs - 1e-9).astype(int), legs - 1)


def _legs_of(corners: Any, times: np.ndarray) -> tuple[Any, Any, Any]:
    """What part of its leg each moment is at, [S], and where that leg begins and ends, [n, d, S]."""
    legs = int(corners.shape[1]) - 1
    leg = leg_at(times, legs)
    a, b = (namespace(corners).swapaxes(corners[:, leg + end], 1, 2) for end in (0, 1))
    return constant(times * legs - leg, corners), a, b


def quaternions(euler: Float[np.ndarray, "time 3"]) -> Float[np.ndarray, "time 4"]:
    """Quaternions (x, y, z, w) of roll, pitch, yaw about the fixed axes."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(euler / 2).T, np.sin(euler / 2).T
    return np.stack(
        [
            sr * cp * cy - cr * sp * sy,
            cr * sp * cy + sr * cp * sy,
            cr * cp * sy - sr * sp * cy,
            cr * cp * cy + sr * sp * sy,
        ],
        axis=1,
    )


def euler_angles(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3"]:
    """Roll, pitch, yaw about the fixed axes of a quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    return np.array(
        [
            np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
            np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
    )


def angular_velocity(quaternion: Float[np.ndarray, "time 4"], dt: float) -> Float[np.ndarray, "time 3"]:
    """Differentiate a sequence of orientations: 2 q̇ q*.

    Args:
        quaternion: orientations (x, y, z, w), [T, 4], without a jump from q to −q.
        dt: s from one to the next.

    Returns:
        Angular velocity in the world, in rad/s, [T, 3].
    """
    change = np.gradient(quaternion, dt, axis=0)
    (x, y, z, w), (dx, dy, dz, dw) = quaternion.T, change.T
    return 2 * np.stack(
        [
            -dw * x + dx * w - dy * z + dz * y,
            -dw * y + dx * z + dy * w - dz * x,
            -dw * z - dx * y + dy * x + dz * w,
        ],
        axis=1,
    )
