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

    def draw(self, rng: np.random.Generator) -> dict[str, float]:
        """One value per parameter, uniform in its interval, drawn in the order of the names."""
        return {name: float(rng.uniform(low, high)) for name, (low, high) in sorted(self.intervals.items())}


def around(nominal: Mapping[str, float], spread: float) -> PhysicsRanges:
    """Every parameter within ±spread of its nominal value (0.05 is five per cent)."""
    return PhysicsRanges({name: (v * (1 - spread), v * (1 + spread)) for name, v in nominal.items()})
