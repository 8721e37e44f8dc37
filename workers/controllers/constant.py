"""The simplest controller: x itself, in every step."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float32

from workers.controllers.controller import Command, Controller
from workers.environments.environment import Channel


@dataclass(frozen=True)
class Constant(Controller):
    """Commands the physical values of x from the first step to the last.

    Attributes:
        parameters: one for every command channel.
    """

    parameters: tuple[Channel, ...]

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
