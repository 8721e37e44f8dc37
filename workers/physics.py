"""The physics of an episode: named parameters, and the ranges they are drawn from."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from workers import plain
from workers.user_code import UserCodeError

Physics = Mapping[str, float]


@dataclass(frozen=True)
class PhysicsRanges:
    """A closed interval for every randomised parameter, by name.

    Raises:
        UserCodeError: when an interval is reversed, or not of finite numbers.
    """

    intervals: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        """Check every interval and freeze the mapping."""
        checked = {
            plain.text(name, "a physics parameter's name"): _range(name, pair)
            for name, pair in self.intervals.items()
        }
        object.__setattr__(self, "intervals", MappingProxyType(checked))

    def __str__(self) -> str:
        """As `ranges` reads it, in the order of the names: equal texts for equal ranges."""
        return ",".join(f"{name}={low}:{high}" for name, (low, high) in sorted(self.intervals.items()))

    def middle(self) -> dict[str, float]:
        """The nominal value of every parameter: the middle of its interval."""
        return {name: (low + high) / 2 for name, (low, high) in self.intervals.items()}

    def draw(self, rng: np.random.Generator) -> dict[str, float]:
        """One value per parameter, uniform in its interval, drawn in the order of the names."""
        return {name: float(rng.uniform(low, high)) for name, (low, high) in sorted(self.intervals.items())}


def _range(name: str, pair: Any) -> tuple[float, float]:
    try:
        low, high = (plain.finite(value, name) for value in pair)
    except (TypeError, ValueError) as error:
        raise UserCodeError(
            f"physics range of {name} must be two finite numbers (low, high), got {pair!r}"
        ) from error
    if not low <= high:
        raise UserCodeError(f"physics range of {name} must satisfy low <= high, got [{low}, {high}]")
    return low, high


def around(nominal: Mapping[str, float], spread: float) -> PhysicsRanges:
    """Let every parameter vary about its nominal value.

    Args:
        nominal: value of every parameter, by name, of either sign.
        spread: to either side, in parts of the value, in [0, 1] (0.05 is five per cent).

    Returns:
        An interval for every parameter; one whose value is 0 does not vary.
    """
    ends = {name: (v * (1 - spread), v * (1 + spread)) for name, v in nominal.items()}
    return PhysicsRanges({name: (min(pair), max(pair)) for name, pair in ends.items()})


def ranges(text: str) -> PhysicsRanges:
    """Ranges written as `friction=1:2.5,restitution=0.05`; a single number is a range of one value.

    Raises:
        ValueError: when a part is not of that form, a parameter is named twice, or a range is impossible.
    """
    intervals: dict[str, tuple[float, float]] = {}
    for part in text.split(","):
        name, _, numbers = (each.strip() for each in part.partition("="))
        low, colon, high = numbers.partition(":")
        if name in intervals:
            raise ValueError(f"physics range of {name} must be given once, got {text!r}")
        try:
            intervals[name] = (float(low), float(high if colon else low))
        except ValueError:
            raise ValueError(
                f"a physics range must be written NAME=LOW:HIGH or NAME=VALUE, got {part.strip()!r}"
            ) from None
    return PhysicsRanges(intervals)
