"""What draws a step of a trajectory by itself; for robots without a scenery of bodies."""

from abc import ABC, abstractmethod
from collections.abc import Mapping

import numpy as np
from jaxtyping import UInt8

State = Mapping[str, float]
"""It is one step of ξ: the value of every channel, by its name."""


class Artist(ABC):
    """Draws steps of ξ: those of an episode, and those that a model makes up."""

    @abstractmethod
    def picture(self, state: State, width: int, height: int) -> UInt8[np.ndarray, "height width 3"]:
        """Draw one step.

        Args:
            state: the step, by the names of the channels of ξ.
            width: in pixels.
            height: in pixels.

        Returns:
            Red, green and blue, from the top left, [height, width, 3].
        """

    def close(self) -> None:  # noqa: B027
        """End what drawing has opened, if anything."""
