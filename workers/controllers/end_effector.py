"""End-effector waypoints turned into joint torques, the 48-D controller of section 7 of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32

from workers.controllers.controller import Command, Controller
from workers.environments.environment import Channel
from workers.environments.tabletop import Tabletop


@dataclass(frozen=True)
class WaypointRanges:
    """Intervals of one waypoint's 8 parameters.

    Attributes:
        position: x, y, z in m.
        orientation: roll, pitch, yaw in rad.
        stiffness: N/m.
        damping: N·s/m.
    """

    position: tuple[tuple[float, float], ...]
    orientation: tuple[tuple[float, float], ...]
    stiffness: tuple[float, float]
    damping: tuple[float, float]

    def channels(self, waypoint: int) -> list[Channel]:
        """The 8 parameters of a waypoint, named after its number."""
        names = ("x", "y", "z", "roll", "pitch", "yaw", "stiffness", "damping")
        units = ("m", "m", "m", "rad", "rad", "rad", "N/m", "N·s/m")
        intervals = (*self.position, *self.orientation, self.stiffness, self.damping)
        return [
            Channel(f"waypoint{waypoint}_{name}", unit, low, high)
            for name, unit, (low, high) in zip(names, units, intervals, strict=True)
        ]


class EndEffectorWaypoints(Controller):
    """Minimum-jerk positions and linear orientations through waypoints, by the transposed Jacobian.

    torque = Jᵀ [kp (p* − p) + kd (ṗ* − ṗ) + p̈*; Kp e(R*, R) + Kd (ω* − ω)] + gravity, clipped to the limits.

    Args:
        waypoints: how many are passed, each after an equal share of the episode.
        ranges: of each waypoint's parameters.
        turning: Kp in N·m/rad and Kd in N·m·s/rad of the hand's orientation.
        torque_limits: N·m of each joint; commands never leave them.
    """

    def __init__(
        self,
        *,
        waypoints: int,
        ranges: WaypointRanges,
        turning: tuple[float, float],
        torque_limits: tuple[float, ...],
    ) -> None:
        self.parameters = tuple(c for n in range(1, waypoints + 1) for c in ranges.channels(n))
        self._waypoints = waypoints
        self._turning = turning
        self._limits = torque_limits

    def start(self, x: Float32[np.ndarray, " d"], environment: Tabletop, horizon: int) -> Command:
        """Plan from the hand's present pose; the command of a step reads the arm's state at that step."""
        points = self.values(x).reshape(self._waypoints, 8)
        arm = environment.arm
        corners = np.vstack([arm.state.position, points[:, :3]])
        turns = np.vstack([_euler(np.array(arm.state.orientation)), points[:, 3:6]])
        turns[0] += 2 * np.pi * np.round((turns[1] - turns[0]) / (2 * np.pi))  # the short way round
        reference = _reference(corners, turns, horizon, environment.control_step)
        gains = np.repeat(points[:, 6:], np.diff(_ends(horizon, self._waypoints)), axis=0)
        steps = np.hstack([*reference, gains]).tolist()
        turning, limits = self._turning, self._limits

        def command(step: int) -> Sequence[float]:
            state = arm.state
            force = _force(steps[step], state.position, state.velocity)
            moment = _moment(steps[step], turning, state.orientation, state.angular_velocity)
            return _torque(force, moment, arm.jacobian(), arm.gravity_torque(), limits)

        return command


def _ends(horizon: int, waypoints: int) -> np.ndarray:
    """Step at which each waypoint is reached, beginning with 0."""
    return np.linspace(0, horizon, waypoints + 1).round().astype(int)


def _reference(
    corners: Float[np.ndarray, "points 3"], turns: Float[np.ndarray, "points 3"], horizon: int, dt: float
) -> tuple[np.ndarray, ...]:
    """Desired position, velocity, acceleration, orientation quaternion, angular velocity of every step."""
    pieces: list[tuple[np.ndarray, ...]] = []
    ends = _ends(horizon, len(corners) - 1)
    for begin, end, a, b, turn_a, turn_b in zip(
        ends, ends[1:], corners, corners[1:], turns, turns[1:], strict=False
    ):
        duration = (end - begin) * dt
        s = (np.arange(1, end - begin + 1) / (end - begin))[:, None]
        quaternion = _quaternion(turn_a + s * (turn_b - turn_a))
        pieces.append((*minimum_jerk(s, a, b, duration), quaternion))
    position, velocity, acceleration, quaternion = (np.concatenate(part) for part in zip(*pieces, strict=True))
    return position, velocity, acceleration, quaternion, _angular_velocity(quaternion, dt)


def minimum_jerk(
    s: Float[np.ndarray, "time 1"], a: Float[np.ndarray, " d"], b: Float[np.ndarray, " d"], duration: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, velocity and acceleration of the minimum-jerk motion a → b at the fractions s of its duration.

    Fifth-order polynomial with zero velocity and acceleration at both ends: 10 s³ − 15 s⁴ + 6 s⁵.
    """
    position = a + (b - a) * (10 * s**3 - 15 * s**4 + 6 * s**5)
    velocity = (b - a) * (30 * s**2 - 60 * s**3 + 30 * s**4) / duration
    acceleration = (b - a) * (60 * s - 180 * s**2 + 120 * s**3) / duration**2
    return position, velocity, acceleration


def _quaternion(euler: Float[np.ndarray, "time 3"]) -> Float[np.ndarray, "time 4"]:
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


def _euler(quaternion: Float[np.ndarray, "4"]) -> Float[np.ndarray, "3"]:
    """Roll, pitch, yaw about the fixed axes of a quaternion (x, y, z, w)."""
    x, y, z, w = quaternion
    return np.array(
        [
            np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)),
            np.arcsin(np.clip(2 * (w * y - z * x), -1, 1)),
            np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)),
        ]
    )


def _angular_velocity(quaternion: Float[np.ndarray, "time 4"], dt: float) -> Float[np.ndarray, "time 3"]:
    """Angular velocity, in the world, of a sequence of orientations: 2 q̇ q*."""
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


def _force(step: Sequence[float], position: Sequence[float], velocity: Sequence[float]) -> list[float]:
    """kp (p* − p) + kd (ṗ* − ṗ) + p̈*, in N (the acceleration acts on a mass of 1 kg)."""
    kp, kd = step[16], step[17]
    wanted = zip(step[0:3], step[3:6], step[6:9], position, velocity, strict=True)
    return [kp * (p_ - p) + kd * (v_ - v) + a_ for p_, v_, a_, p, v in wanted]


def _moment(
    step: Sequence[float], gains: tuple[float, float], orientation: Sequence[float], spin: Sequence[float]
) -> list[float]:
    """Kp e + Kd (ω* − ω), in N·m, with e the rotation vector from the present to the wanted orientation."""
    kp, kd = gains
    a, b, c, d = step[9:13]
    x, y, z, w = orientation
    sign = 2.0 if a * x + b * y + c * z + d * w >= 0.0 else -2.0
    error = (
        sign * (w * a - x * d - b * z + c * y),
        sign * (w * b - y * d - c * x + a * z),
        sign * (w * c - z * d - a * y + b * x),
    )
    return [kp * e + kd * (w_ - w) for e, w_, w in zip(error, step[13:16], spin, strict=True)]


def _torque(
    force: Sequence[float],
    moment: Sequence[float],
    jacobian: tuple[tuple[Sequence[float], ...], tuple[Sequence[float], ...]],
    gravity: Sequence[float],
    limits: Sequence[float],
) -> list[float]:
    """Jᵀ [force; moment] + gravity, clipped to ± the limits."""
    (fx, fy, fz), (mx, my, mz) = force, moment
    columns = zip(*jacobian[0], *jacobian[1], gravity, limits, strict=False)  # the arm's joints come first
    torques = [
        (a * fx + b * fy + c * fz + d * mx + e * my + f * mz + g, limit)
        for a, b, c, d, e, f, g, limit in columns
    ]
    return [min(max(torque, -limit), limit) for torque, limit in torques]
