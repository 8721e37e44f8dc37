"""End-effector waypoints turned into joint torques, the 48-D controller of section 7 of the paper."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float32

from workers.controllers.arrays import constant, namespace
from workers.controllers.controller import Command, Controller, PlanTimes
from workers.controllers.reference import (
    ends,
    euler_angles,
    leg_at,
    line_through,
    motion_through,
    reference,
)
from workers.environments.environment import Channel
from workers.environments.tabletop import ArmScene
from workers.plans import HandPlan, PlannedCommand

Triple = tuple[float, float, float]

_ANGLES = ("roll", "pitch", "yaw")
_FAST = 5.0  # m in an episode's time; few plans are faster
_FAR = 1.0  # m
_NEAR = 1e-3  # m; a distance has a derivative at 0, too

# Columns of a planned step.
_POSITION, _VELOCITY, _ACCELERATION = slice(0, 3), slice(3, 6), slice(6, 9)
_ORIENTATION, _SPIN, _GAINS = slice(9, 13), slice(13, 16), slice(16, 18)


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
        home: position (m) and roll, pitch, yaw (rad) of the hand where an episode begins; `plans` tells from
            here what is wanted up to the first waypoint.
        objects: x and y in m of what is on the table at first; a plan tells how far the hand is from each.
    """

    def __init__(
        self,
        *,
        waypoints: int,
        ranges: WaypointRanges,
        turning: tuple[float, float],
        torque_limits: tuple[float, ...],
        home: tuple[float, ...],
        objects: tuple[tuple[float, float], ...],
    ) -> None:
        self.parameters = tuple(c for n in range(1, waypoints + 1) for c in ranges.channels(n))
        self._ranges = ranges
        self._home = home
        self._objects = objects
        self._waypoints = waypoints
        self._turning = turning
        self._limits = torque_limits

    @property
    def planned(self) -> tuple[Channel, ...]:
        """The hand's pose and velocity, both gains, and distances to the objects."""
        ranges, (low, high) = self._ranges, (-_FAST, _FAST)
        pose = zip("xyz", ranges.position, strict=True), zip(_ANGLES, ranges.orientation, strict=True)
        return (
            *(Channel(f"hand_{axis}", "m", *interval) for axis, interval in pose[0]),
            *(Channel(f"hand_v{axis}", "m/episode", low, high) for axis in "xyz"),
            *(Channel(f"hand_{angle}", "rad", *interval) for angle, interval in pose[1]),
            Channel("stiffness", "N/m", *ranges.stiffness),
            Channel("damping", "N·s/m", *ranges.damping),
            *(Channel(f"distance_{number}", "m", 0.0, _FAR) for number, _ in enumerate(self._objects, 1)),
        )

    def plans(self, x: Any, moments: PlanTimes) -> Any:
        """What the hand wants: pose, velocity, gains, and how far it will be from where objects start.

        Args:
            x: controllers in the unit cube, [n, D], an array of NumPy or torch.
            moments: when.

        Returns:
            The channels of `planned`, [n, channels, S].
        """
        xp, times = namespace(x), moments.parts
        points = self.physical(x).reshape(x.shape[0], self._waypoints, 8)
        home = constant(self._home, x) + 0.0 * points[:, :1, :6]
        corners = xp.concatenate([home, points[:, :, :6]], 1)
        position, velocity = motion_through(corners[:, :, :3], times)
        angles = line_through(corners[:, :, 3:], times)
        gains = xp.swapaxes(points[:, leg_at(times, self._waypoints), 6:], 1, 2)
        far = [
            ((position[:, 0] - px) ** 2 + (position[:, 1] - py) ** 2 + _NEAR**2) ** 0.5
            for px, py in self._objects
        ]
        distances = [xp.stack(far, 1)] if far else []
        return xp.concatenate([position, velocity, angles, gains, *distances], 1)

    def start(self, x: Float32[np.ndarray, " d"], environment: ArmScene, horizon: int) -> Command:
        """Plan from the hand's present pose; the command of a step reads the arm's state at that step.

        Args:
            x: the controller, [D], in [0, 1].
            environment: the scene whose arm is moved.
            horizon: T, control steps.

        Returns:
            Joint torques in N·m for each step.
        """
        points = self.values(x).reshape(self._waypoints, 8)
        arm = environment.arm
        corners = np.vstack([arm.state.position, points[:, :3]])
        turns = np.vstack([euler_angles(np.array(arm.state.orientation)), points[:, 3:6]])
        turns[0] += 2 * np.pi * np.round((turns[1] - turns[0]) / (2 * np.pi))  # the short way round
        targets = reference(corners, turns, horizon, environment.control_step)
        gains = np.repeat(points[:, 6:], np.diff(ends(horizon, self._waypoints)), axis=0)
        plan = HandPlan(np.hstack([*targets, gains]), self._turning, self._limits)
        steps, turning, limits = plan.rows, plan.turning, plan.torque_limits

        def command(step: int) -> Sequence[float]:
            state = arm.state
            row = steps[step].tolist()  # kept as floats, they would fill the caches
            force = _force(
                row[_GAINS],
                row[_POSITION],
                row[_VELOCITY],
                row[_ACCELERATION],
                state.position,
                state.velocity,
            )
            moment = _moment(
                turning, row[_ORIENTATION], row[_SPIN], state.orientation, state.angular_velocity
            )
            return _torque(force, moment, arm.jacobian(), arm.gravity_torque(), limits)

        return PlannedCommand(command, plan)


def _force(
    gains: Sequence[float],
    wanted_position: Sequence[float],
    wanted_velocity: Sequence[float],
    wanted_acceleration: Sequence[float],
    position: Sequence[float],
    velocity: Sequence[float],
) -> Triple:
    """The force kp (p* − p) + kd (ṗ* − ṗ) + p̈*, in N (the acceleration acts on a mass of 1 kg)."""
    kp, kd = gains
    (x_, y_, z_), (vx_, vy_, vz_), (ax_, ay_, az_) = wanted_position, wanted_velocity, wanted_acceleration
    (x, y, z), (vx, vy, vz) = position, velocity
    return (
        kp * (x_ - x) + kd * (vx_ - vx) + ax_,
        kp * (y_ - y) + kd * (vy_ - vy) + ay_,
        kp * (z_ - z) + kd * (vz_ - vz) + az_,
    )


def _moment(
    gains: Sequence[float],
    wanted_orientation: Sequence[float],
    wanted_spin: Sequence[float],
    orientation: Sequence[float],
    spin: Sequence[float],
) -> Triple:
    """The moment Kp e + Kd (ω* − ω), in N·m; e = 2 sin(θ/2) · axis of the rotation still to be made."""
    kp, kd = gains
    a, b, c, d = wanted_orientation
    x, y, z, w = orientation
    (wx_, wy_, wz_), (wx, wy, wz) = wanted_spin, spin
    # q and −q are one orientation: turn the short way.
    stiffness = 2.0 * kp if a * x + b * y + c * z + d * w >= 0.0 else -2.0 * kp
    return (
        stiffness * (w * a - x * d - b * z + c * y) + kd * (wx_ - wx),
        stiffness * (w * b - y * d - c * x + a * z) + kd * (wy_ - wy),
        stiffness * (w * c - z * d - a * y + b * x) + kd * (wz_ - wz),
    )


def _torque(
    force: Sequence[float],
    moment: Sequence[float],
    jacobian: tuple[tuple[Sequence[float], ...], tuple[Sequence[float], ...]],
    gravity: Sequence[float],
    limits: Sequence[float],
) -> list[float]:
    """Jᵀ [force; moment] + gravity, clipped to ± the limits."""
    (fx, fy, fz), (mx, my, mz) = force, moment
    # The arm's joints come first; the fingers behind them have no limits here and are not commanded.
    columns = zip(*jacobian[0], *jacobian[1], gravity, limits, strict=False)
    return [
        limit if torque > limit else -limit if torque < -limit else torque
        for a, b, c, d, e, f, g, limit in columns
        for torque in (a * fx + b * fy + c * fz + d * mx + e * my + f * mz + g,)
    ]
