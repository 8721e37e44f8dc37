"""The simplest controller: x itself, in every step."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float32

from workers.controllers.arrays import constant
from workers.controllers.controller import Command, Controller, PlanTimes
from workers.environments.environment import Channel


@dataclass(frozen=True)
class Constant(Controller):
    """Commands the physical values of x from the first step to the last.

    Attributes:
        parameters: one for every command channel.
    """

    parameters: tuple[Channel, ...]

    @property
    def planned(self) -> tuple[Channel, ...]:
        """The commands."""
        return self.parameters

    def plans(self, x: Any, moments: PlanTimes) -> Any:
        """What is commanded.

        Args:
            x: controllers in the unit cube, [n, D], an array of NumPy or torch.
            moments: when.

        Returns:
            The channels of `planned`, [n, channels, S].
        """
        return self.physical(x)[:, :, None] + constant(0.0 * moments.parts, x)

    def start(self, x: Float32[np.ndarray, " d"], environment: Any, horizon: int) -> Command:  # noqa: ARG002
        """Command the same in every step.

        Args:
            x: the controller, [D], in [0, 1].
            environment: not looked at.
            horizon: not looked at.

        Returns:
            The physical values of x, whatever the step.
        """
        command = self.values(x).tolist()
        return lambda _: command
