"""The physics of an episode: named parameters, and the ranges they are drawn from."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

Physics = Mapping[str, float]


@dataclass(frozen=True)
class PhysicsRanges:
    """A closed interval for every randomised parameter, by name.

    Raises:
        ValueError: when an interval is reversed, negative or not finite.
    """

    intervals: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        """Check every interval and freeze the mapping."""
        for name, (low, high) in self.intervals.items():
            if not (math.isfinite(low) and math.isfinite(high) and 0.0 <= low <= high):
                raise ValueError(
                    f"physics range of {name} must satisfy 0 <= low <= high, got [{low}, {high}]"
                )
        object.__setattr__(self, "intervals", MappingProxyType(dict(self.intervals)))

    def __str__(self) -> str:
        """As `ranges` reads it, in the order of the names: equal texts for equal ranges."""
        return ",".join(f"{name}={low}:{high}" for name, (low, high) in sorted(self.intervals.items()))

    def middle(self) -> dict[str, float]:
        """The nominal value of every parameter: the middle of its interval."""
        return {name: (low + high) / 2 for name, (low, high) in self.intervals.items()}

    def draw(self, rng: np.random.Generator) -> dict[str, float]:
        """One value per parameter, uniform in its interval, drawn in the order of the names."""
        return {name: float(rng.uniform(low, high)) for name, (low, high) in sorted(self.intervals.items())}


def around(nominal: Mapping[str, float], spread: float) -> PhysicsRanges:
    """Let every parameter vary about its nominal value.

    Args:
        nominal: value of every parameter, by name, at least 0.
        spread: to either side, in parts of the value, in [0, 1] (0.05 is five per cent).

    Returns:
        An interval for every parameter.
    """
    return PhysicsRanges({name: (v * (1 - spread), v * (1 + spread)) for name, v in nominal.items()})


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
