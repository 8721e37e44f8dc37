"""Commands through waypoints: the open-loop controller of any robot."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float, Float32

from workers.controllers.controller import Command, Controller, PlanTimes
from workers.controllers.reference import line_through
from workers.environments.environment import Channel


class Waypoints(Controller):
    """Every command channel runs on straight lines from one waypoint to the next, whatever the robot does.

    The first waypoint is the command of the first step and the last that of the last; the others lie between
    at equal distances in time. D = waypoints · channels.

    Args:
        action: the command channels; a waypoint may lie anywhere within their bounds.
        count: how many waypoints there are, at least 2.
    """

    def __init__(self, action: Sequence[Channel], count: int) -> None:
        if count < 2:
            raise ValueError(f"count must be at least 2 waypoints, a first and a last, got {count}")
        self._count = count
        self._action = tuple(action)
        self._low = np.array([channel.low for channel in action])
        self._high = np.array([channel.high for channel in action])
        self.parameters = tuple(
            Channel(f"waypoint{number}_{channel.name}", channel.unit, channel.low, channel.high)
            for number in range(1, count + 1)
            for channel in action
        )

    @property
    def planned(self) -> tuple[Channel, ...]:
        """The commands."""
        return self._action

    def plans(self, x: Any, moments: PlanTimes) -> Any:
        """What is commanded.

        Args:
            x: controllers in the unit cube, [n, D], an array of NumPy or torch.
            moments: when.

        Returns:
            The channels of `planned`, [n, channels, S].
        """
        points = self.physical(x).reshape(x.shape[0], self._count, -1)
        last = max(moments.horizon - 1, 1)  # the first waypoint is the command of the first step
        return line_through(points, (moments.steps - 1) / last)

    def start(self, x: Float32[np.ndarray, " d"], environment: Any, horizon: int) -> Command:  # noqa: ARG002
        """Plan all commands at once: nothing that happens to the robot changes them.

        Args:
            x: the controller, [D], in [0, 1].
            environment: not looked at.
            horizon: T, control steps.

        Returns:
            The command of each step, in the units of the channels.
        """
        plan = self.plan(x, horizon).tolist()
        return lambda step: plan[step]

    def plan(self, x: Float32[np.ndarray, " d"], horizon: int) -> Float[np.ndarray, "time channels"]:
        """Plan the commands of all steps.

        Args:
            x: the controller, [D], in [0, 1].
            horizon: T, control steps.

        Returns:
            Commands in the units of the channels, [T, channels].
        """
        points = self.values(x).reshape(self._count, -1)
        place = np.linspace(0.0, self._count - 1.0, horizon)
        columns = [np.interp(place, np.arange(self._count), column) for column in points.T]
        return np.clip(np.stack(columns, axis=1), self._low, self._high)  # rounding
