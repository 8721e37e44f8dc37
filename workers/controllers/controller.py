"""What a controller is to the control loop, and how x is checked."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float, Float32, Int

from workers.controllers.arrays import constant
from workers.environments.environment import Channel, Command

__all__ = ["Command", "Controller", "PlanTimes", "unit_cube"]


@dataclass(frozen=True, eq=False)
class PlanTimes:
    """When plans are told: at the ends of some control steps of an episode.

    Attributes:
        steps: counted from 1 to the horizon, rising.
        horizon: T, control steps.
        control_step: s.
    """

    steps: Int[np.ndarray, " s"]
    horizon: int
    control_step: float

    @property
    def parts(self) -> Float[np.ndarray, " s"]:
        """In parts of the episode, in (0, 1]."""
        return self.steps / self.horizon


class Controller(ABC):
    """A family of controllers, one for every x in [0,1]^D."""

    parameters: tuple[Channel, ...]

    @property
    def dimensions(self) -> int:
        """D, the length of x."""
        return len(self.parameters)

    def values(self, x: Float32[np.ndarray, " d"]) -> np.ndarray:
        """Physical values of the parameters, in the order and units of `parameters`."""
        low = np.array([parameter.low for parameter in self.parameters])
        high = np.array([parameter.high for parameter in self.parameters])
        return low + x.astype(np.float64) * (high - low)

    @property
    def planned(self) -> tuple[Channel, ...]:
        """Channels of the plan that `plans` gives; none where a controller offers no plan."""
        return ()

    def plans(self, x: Any, moments: PlanTimes) -> Any:
        """What controllers want before the world answers: a function of x alone.

        A model may read it in place of x. It is told in the channels of `planned`, and need not be what the
        controller commands: a command may answer to the world.

        Args:
            x: controllers in the unit cube, [n, D], an array of NumPy or torch; gradients reach it.
            moments: when.

        Returns:
            The plans at these moments, [n, channels, S], of the same kind as x.

        Raises:
            NotImplementedError: this controller offers none.
        """
        raise NotImplementedError(f"{type(self).__name__} offers no plan: `planned` is empty")

    def physical(self, x: Any) -> Any:
        """Physical values of many controllers, [n, D] as x, in the units of `parameters`."""
        low = constant([parameter.low for parameter in self.parameters], x)
        high = constant([parameter.high for parameter in self.parameters], x)
        return low + x * (high - low)

    @abstractmethod
    def start(self, x: Float32[np.ndarray, " d"], environment: Any, horizon: int) -> Command:
        """Plan `horizon` steps of the controller x from the environment's present state.

        Args:
            x: the controller, [D], in [0, 1].
            environment: the simulation that is controlled, open and reset.
            horizon: T, control steps.

        Returns:
            The command of each step, from 0 to horizon − 1; it may read the environment as it is then.
        """


def unit_cube(x: Sequence[float] | np.ndarray, dimensions: int) -> Float32[np.ndarray, " d"]:
    """Refuse a controller unless it is a finite vector of D numbers in [0, 1].

    Args:
        x: the controller.
        dimensions: D.

    Returns:
        A copy of x as float32, [D].

    Raises:
        ValueError: naming what is wrong with x.
    """
    vector = np.array(x, dtype=np.float32)
    if vector.shape != (dimensions,):
        raise ValueError(f"x must have shape ({dimensions},), got {vector.shape}")
    outside = np.flatnonzero(~((vector >= 0.0) & (vector <= 1.0)))
    if outside.size:
        raise ValueError(f"x must lie in [0, 1]; x[{outside[0]}] is {vector[outside[0]]!s}")
    return vector
