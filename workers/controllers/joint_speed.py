"""Joint-speed waypoints, the other 48-D controller of section 7 of the paper."""

from collections.abc import Sequence
from itertools import chain
from typing import Any

import numpy as np
from jaxtyping import Float, Float32

from workers.controllers.arrays import constant, namespace
from workers.controllers.controller import Command, Controller, PlanTimes
from workers.controllers.reference import minimum_jerk, rise
from workers.environments.environment import Channel
from workers.environments.tabletop import ArmScene
from workers.plans import JointPlan, PlannedCommand

SHARE = (0.1, 1.0)
"""The durations of waypoints lie in this range before they are divided by their sum. It does not begin at 0,
for a speed cannot change at once."""


class JointSpeedWaypoints(Controller):
    """Smooth changes from one joint speed to the next, each within its own share of the episode.

    From rest, v(s) = v_n + (v_{n+1} − v_n)(10 s³ − 15 s⁴ + 6 s⁵), s running from 0 to 1 during the share of
    waypoint n + 1. No command leaves the speed limits, whatever x; and a joint beyond one of its angle limits
    is commanded only inwards.

    Args:
        waypoints: how many speeds are attained.
        joints: names of the joints.
        speed_limits: rad/s of each joint.
        lower: lowest angle of each joint, in rad, at which it is still driven downwards.
        upper: highest angle of each joint, in rad, at which it is still driven upwards.
    """

    def __init__(
        self,
        *,
        waypoints: int,
        joints: tuple[str, ...],
        speed_limits: tuple[float, ...],
        lower: tuple[float, ...],
        upper: tuple[float, ...],
    ) -> None:
        self._waypoints = waypoints
        self._joints = joints
        self._limits = np.array(speed_limits)
        self._lower = lower
        self._upper = upper
        speeds = [(joint, limit) for joint, limit in zip(joints, speed_limits, strict=True)]
        self.parameters = tuple(chain.from_iterable(_channels(n, speeds) for n in range(1, waypoints + 1)))

    @property
    def planned(self) -> tuple[Channel, ...]:
        """Speed of each joint, and the angle that it would lead to."""
        limits = dict(zip(self._joints, self._limits.tolist(), strict=True))
        return (
            *(Channel(f"{joint}_speed", "rad/s", -limit, limit) for joint, limit in limits.items()),
            *(Channel(f"{joint}_turn", "rad", -limit, limit) for joint, limit in limits.items()),
        )

    def plans(self, x: Any, moments: PlanTimes) -> Any:
        """What the joints want, whatever their limits: their speeds, and how far these turn them.

        A sum over waypoints: each adds its change of speed, which rises from 0 to 1 during its share of the
        episode.

        Args:
            x: controllers in the unit cube, [n, D], an array of NumPy or torch.
            moments: when.

        Returns:
            The channels of `planned`, [n, channels, S].
        """
        xp = namespace(x)
        points = self.physical(x).reshape(x.shape[0], self._waypoints, -1)
        speeds, shares = points[:, :, :-1], points[:, :, -1]
        changes = xp.concatenate([speeds[:, :1], speeds[:, 1:] - speeds[:, :-1]], 1)
        durations = shares / shares.sum(1)[:, None]
        begins = xp.cumsum(durations, 1) - durations
        s = (constant(moments.parts, x)[None, :, None] - begins[:, None]) / durations[:, None]
        inside, after = xp.clip(s, 0.0, 1.0), xp.clip(s - 1.0, 0.0, None)
        area = (2.5 * inside**4 - 3 * inside**5 + inside**6 + after) * durations[:, None]
        seconds = moments.horizon * moments.control_step
        both = [rise(inside) @ changes, seconds * (area @ changes)]
        return xp.concatenate([xp.swapaxes(part, 1, 2) for part in both], 1)

    def start(self, x: Float32[np.ndarray, " d"], environment: ArmScene, horizon: int) -> Command:
        """Plan all speeds; the command of a step reads the joints at that step.

        Args:
            x: the controller, [D], in [0, 1].
            environment: the scene whose arm is moved.
            horizon: T, control steps.

        Returns:
            Joint speeds in rad/s for each step.
        """
        plan = self.plan(x, horizon)
        arm = environment.arm
        lower, upper = self._lower, self._upper

        def command(step: int) -> Sequence[float]:
            return _inwards(plan[step].tolist(), arm.state.joints, lower, upper)

        return PlannedCommand(command, JointPlan(plan, lower, upper))

    def plan(self, x: Float32[np.ndarray, " d"], horizon: int) -> Float[np.ndarray, "time joints"]:
        """Plan the joint speeds of all steps, whatever the joints' angles.

        Args:
            x: the controller, [D], in [0, 1].
            horizon: T, control steps.

        Returns:
            Speeds wanted at the end of every step, in rad/s, [horizon, joints].
        """
        points = self.values(x).reshape(self._waypoints, -1)
        speeds = np.vstack([np.zeros(len(self._limits)), points[:, :-1]])
        ends = horizon * np.cumsum(points[:, -1]) / points[:, -1].sum()
        starts = np.concatenate([[0.0], ends[:-1]])
        step = np.arange(1, horizon + 1)
        leg = np.searchsorted(ends[:-1], step)
        duration = (ends - starts)[leg, None]
        s = (step[:, None] - starts[leg, None]) / duration
        wanted, _, _ = minimum_jerk(s, speeds[leg], speeds[leg + 1], duration)
        return np.clip(wanted, -self._limits, self._limits)  # rounding


def _inwards(
    speeds: Sequence[float], angles: Sequence[float], lower: Sequence[float], upper: Sequence[float]
) -> list[float]:
    """The speeds, but 0 for every one that would lead a joint further beyond its limit."""
    return [
        0.0 if (speed > 0.0 and angle >= high) or (speed < 0.0 and angle <= low) else speed
        for speed, angle, low, high in zip(speeds, angles, lower, upper, strict=True)
    ]


def _channels(waypoint: int, speeds: Sequence[tuple[str, float]]) -> list[Channel]:
    """The parameters of a waypoint: a speed for every joint, then its duration."""
    prefix = f"waypoint{waypoint}"
    return [
        *(Channel(f"{prefix}_{joint}", "rad/s", -limit, limit) for joint, limit in speeds),
        Channel(f"{prefix}_duration", "1", *SHARE),
    ]
