"""What every simulated environment offers to the control loop."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from jaxtyping import Float32

from workers.physics import Physics
from workers.simulation.artist import Artist
from workers.simulation.scenery import Scenery


@dataclass(frozen=True)
class Channel:
    """One observed or commanded number: its name, unit, and fixed bounds."""

    name: str
    unit: str
    low: float
    high: float

    def __post_init__(self) -> None:
        """Refuse empty bounds."""
        if not self.low < self.high:
            raise ValueError(
                f"bounds of channel {self.name} must satisfy low < high, got [{self.low}, {self.high}]"
            )


@dataclass(frozen=True)
class Observed:
    """What was seen after each of T control steps.

    Attributes:
        xi: the trajectory ξ, one row per observation channel, in the channels' units.
        signals: further arrays [..., T] by name that tasks need and models do not see, contacts among them.
    """

    xi: Float32[np.ndarray, "obs time"]
    signals: Mapping[str, np.ndarray]


class Environment(ABC):
    """A simulated robot in its scene. One instance is reused for many episodes.

    Class attributes of a concrete environment:
        observation: the channels of ξ, in order.
        action: the channels of a command, in order.
        control_step: seconds between commands.
        scenery: what pictures of it show, or what draws them; None where there is nothing to see.
    """

    observation: tuple[Channel, ...]
    action: tuple[Channel, ...]
    control_step: float
    scenery: Scenery | Artist | None = None

    @abstractmethod
    def reset(self, physics: Physics) -> None:
        """Return to the start pose under the given physics, with nothing left of earlier episodes."""

    @abstractmethod
    def step(self, command: Sequence[float]) -> Any:
        """Apply one command, advance one control step, and return the raw record of what is seen then."""

    @abstractmethod
    def record(self) -> Any:
        """The raw record of what is seen now; raw, because converting whole episodes at once is cheaper."""

    @abstractmethod
    def observed(self, records: Sequence[Any]) -> Observed:
        """Convert the raw records of consecutive steps, all at once."""

    @abstractmethod
    def close(self) -> None:
        """End the simulation."""

    def __enter__(self) -> "Environment":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
