"""A point that is where it is told to be: the environment of setups that are formulas."""

from collections.abc import Sequence

import numpy as np

from workers.environments.environment import Channel, Environment, Observed
from workers.physics import Physics

Record = tuple[float, ...]


def coordinates(dimensions: int) -> tuple[Channel, ...]:
    """The channels x1, x2, … of a point in the unit cube."""
    return tuple(Channel(f"x{number}", "1", 0.0, 1.0) for number in range(1, dimensions + 1))


class Point(Environment):
    """A point in [0,1]^D, at the origin after a reset; a command is its next place. There are no signals."""

    control_step = 1.0  # s; there is no time in a formula

    def __init__(self, dimensions: int) -> None:
        self.observation = self.action = coordinates(dimensions)
        self._place: Record = (0.0,) * dimensions

    def reset(self, physics: Physics) -> None:  # noqa: ARG002
        """To the origin; there is no physics."""
        self._place = (0.0,) * len(self.action)

    def step(self, command: Sequence[float]) -> Record:
        """Go to the commanded place."""
        self._place = tuple(command)
        return self._place

    def record(self) -> Record:
        """Where the point is."""
        return self._place

    def observed(self, records: Sequence[Record]) -> Observed:
        """One row of ξ per coordinate."""
        return Observed(xi=np.array(records, dtype=np.float32).T, signals={})

    def close(self) -> None:
        """Nothing to end."""
