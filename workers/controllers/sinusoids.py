"""Commands that swing: the open-loop gait of any robot."""

from collections.abc import Sequence
from math import pi
from typing import Any

import numpy as np
from jaxtyping import Float, Float32

from workers.controllers.arrays import constant, namespace
from workers.controllers.controller import Command, Controller, PlanTimes
from workers.environments.environment import Channel, Environment


class Sinusoids(Controller):
    """u_j(t) = c_j + a_j sin(2π v t + φ_j), all command channels at one frequency v, clipped to their bounds.

    D = 1 + 3 · command channels. Amplitudes a and centres c are in the units of the commands; their ranges
    are shares of half the range of each, about its middle.

    Args:
        action: the command channels.
        frequency: least and greatest v, in Hz.
        amplitude: greatest a as a share, in (0, 1].
        center: farthest c from the middle as a share, in (0, 1].
    """

    def __init__(
        self, action: Sequence[Channel], *, frequency: tuple[float, float], amplitude: float, center: float
    ) -> None:
        for name, share in (("amplitude", amplitude), ("center", center)):
            if not 0.0 < share <= 1.0:
                raise ValueError(f"{name} must be a share of half a range, in (0, 1], got {share}")
        self._action = tuple(action)
        self._low = np.array([channel.low for channel in action])
        self._high = np.array([channel.high for channel in action])
        self.parameters = (
            Channel("frequency", "Hz", *frequency),
            *(part for channel in action for part in _parameters(channel, amplitude, center)),
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
        xp, values = namespace(x), self.physical(x)
        seconds = constant((moments.steps - 1) * moments.control_step, x)
        amplitude, phase, center = (values[:, first::3, None] for first in (1, 2, 3))
        commands = center + amplitude * xp.sin(2 * pi * values[:, :1, None] * seconds + phase)
        low, high = (constant(limits[:, None], x) for limits in (self._low, self._high))
        return xp.minimum(xp.maximum(commands, low), high)

    def start(self, x: Float32[np.ndarray, " d"], environment: Environment, horizon: int) -> Command:
        """Plan all commands at once: nothing that happens to the robot changes them.

        Args:
            x: the controller, [D], in [0, 1].
            environment: the simulation that is controlled, which knows the time between commands.
            horizon: T, control steps.

        Returns:
            The command of each step, in the units of the channels.
        """
        plan = self.plan(x, np.arange(horizon) * environment.control_step).tolist()
        return lambda step: plan[step]

    def plan(
        self, x: Float32[np.ndarray, " d"], seconds: Float[np.ndarray, " time"]
    ) -> Float[np.ndarray, "time channels"]:
        """Plan commands.

        Args:
            x: the controller, [D], in [0, 1].
            seconds: t of each, in s.

        Returns:
            Commands in the units of the channels, [T, channels].
        """
        frequency, *waves = self.values(x)
        amplitude, phase, center = np.reshape(waves, (-1, 3)).T
        swing = np.sin(2 * pi * frequency * seconds[:, None] + phase)
        return np.clip(center + amplitude * swing, self._low, self._high)


def _parameters(channel: Channel, amplitude: float, center: float) -> tuple[Channel, ...]:
    middle, half = (channel.low + channel.high) / 2, (channel.high - channel.low) / 2
    return (
        Channel(f"{channel.name}_amplitude", channel.unit, 0.0, amplitude * half),
        Channel(f"{channel.name}_phase", "rad", -pi, pi),
        Channel(f"{channel.name}_center", channel.unit, middle - center * half, middle + center * half),
    )
