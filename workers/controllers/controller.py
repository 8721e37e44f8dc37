"""What a controller is to the control loop, and how x is checked."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
from jaxtyping import Float32

from workers.environments.environment import Channel, Command

__all__ = ["Command", "Controller", "unit_cube"]


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
