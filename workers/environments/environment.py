"""What every simulated environment offers to the control loop."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import TracebackType
from typing import Any

import numpy as np
from jaxtyping import Float32

from workers import plain
from workers.physics import Physics
from workers.simulation.artist import Artist
from workers.simulation.scenery import Scenery
from workers.user_code import UserCodeError

Command = Callable[[int], Sequence[float]]
"""It leads from the index of a control step to the command applied in it."""

_LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Channel:
    """One observed or commanded number.

    Attributes:
        name: of it; the channels of one kind have different names.
        unit: of it, such as `rad`; `1` for a pure number.
        low: the lower bound, finite.
        high: the upper bound, finite: trajectories are stored between the two, and one that leaves them
            counts as an exploded simulation.
    """

    name: str
    unit: str
    low: float
    high: float

    def __post_init__(self) -> None:
        """Refuse bounds that are empty or not finite; scalars of NumPy become plain numbers.

        Raises:
            UserCodeError: naming the channel, the bounds and the remedy.
        """
        name = plain.text(self.name, "the name of a channel")
        for bound in ("low", "high"):
            value = plain.plain(getattr(self, bound))
            if not isinstance(value, int | float) or isinstance(value, bool) or not abs(value) <= _LARGEST:
                raise UserCodeError(
                    f"bounds of channel {name} must be finite numbers that fit float32, got [{self.low}, "
                    f"{self.high}]; give the widest values that a sound episode reaches, with a margin"
                )
            object.__setattr__(self, bound, value)
        if not self.low < self.high:
            raise UserCodeError(
                f"bounds of channel {name} must satisfy low < high, got [{self.low}, {self.high}]"
            )
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "unit", str(self.unit))


@dataclass(frozen=True)
class Observed:
    """What was seen after each of T control steps.

    Attributes:
        xi: the trajectory ξ, one row per observation channel, in the channels' units.
        signals: further arrays [..., T] by name that tasks need and models do not see, contacts among them.
    """

    xi: Float32[np.ndarray, "obs time"]
    signals: Mapping[str, np.ndarray]


def check_observed(observed: Any, channels: Sequence[Channel], steps: int, owner: str) -> Observed:
    """Refuse what `observed` of an environment returned unless its rows are channels and its columns steps.

    Args:
        observed: what it returned.
        channels: of ξ, as the setup states them.
        steps: T, how many records it was given.
        owner: name of the setup, for the error.

    Returns:
        The same.

    Raises:
        UserCodeError: it has another type or shape; the message names channels, steps and the remedy.
    """
    if not isinstance(observed, Observed) or not isinstance(observed.xi, np.ndarray):
        raise UserCodeError(
            f"observed() of {owner} must return Observed(xi, signals) with an array xi, got "
            f"{type(observed).__name__}{_kind_of_xi(observed)}"
        )
    xi, expected = observed.xi, (len(channels), steps)
    if xi.dtype.kind not in "fiub":
        raise UserCodeError(f"observed() of {owner} must give ξ of numbers, got {xi.dtype}")
    if xi.shape != expected:
        raise UserCodeError(
            f"observed() of {owner} gave ξ {list(xi.shape)}, the setup has {len(channels)} channels "
            f"({', '.join(channel.name for channel in channels)}) and {steps} steps: "
            + (
                "transpose it"
                if xi.shape == expected[::-1]
                else "give one row per channel, one column per step"
            )
        )
    for name, signal in observed.signals.items():
        if np.shape(signal)[-1:] != (steps,):
            raise UserCodeError(
                f"observed() of {owner} gave the signal {name!r} with shape {list(np.shape(signal))}; its "
                f"last axis must be the {steps} steps"
            )
    return observed


def _kind_of_xi(observed: Any) -> str:
    return f" with xi {type(observed.xi).__name__}" if isinstance(observed, Observed) else ""


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

    def run_commands(self, command: Command, steps: int) -> Any:
        """Apply the commands of the steps from 0 on, one after the other.

        This is the control loop. An environment that can execute the plan behind a command by itself
        (`workers.plans`) may do so, with the same records.

        Args:
            command: of each step.
            steps: how many.

        Returns:
            The record of each step, together as `observed` takes them.
        """
        step = self.step
        return [step(command(t)) for t in range(steps)]

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
