"""The box that TuRBO searches: it grows with success, shrinks with failure, and follows from the history."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import torch
from jaxtyping import Float
from torch import Tensor

FIRST_LENGTH: Final = 0.8
LARGEST_LENGTH: Final = 1.6
SMALLEST_LENGTH: Final = 0.5**7
"""All are sides of the box before weighting (Eriksson et al., NeurIPS 2019); a smaller one starts anew."""
SUCCESSES: Final = 3
"""After so many in a row the box doubles."""
RANDOM_TRIALS: Final = 2
"""Every box starts with so many, as a run does."""
_LEAST_GAIN: Final = 1e-3


@dataclass(frozen=True)
class TrustRegion:
    """State of TuRBO-1.

    Attributes:
        dimensions: D.
        first: Trial the box began with; earlier ones are forgotten.
        trials: Trials since then.
        length: Side of the box.
        best: Largest objective since then.
        successes: Improvements in a row.
        failures: Trials without one in a row.
    """

    dimensions: int
    first: int = 0
    trials: int = 0
    length: float = FIRST_LENGTH
    best: float = -math.inf
    successes: int = 0
    failures: int = 0

    @classmethod
    def after(cls, f: Sequence[float], dimensions: int) -> "TrustRegion":
        """Replay a run; trials without an objective change nothing.

        Args:
            f: Objectives measured, in the order of their trials.
            dimensions: D.

        Returns:
            The state that they have led to.
        """
        state = cls(dimensions)
        for each in f:
            state = state.then(each)
        return state

    @property
    def failures_allowed(self) -> int:
        """In a row, before the box halves."""
        return max(4, self.dimensions)

    @property
    def begins(self) -> bool:
        """Whether the next trial is one of the random ones."""
        return self.trials < RANDOM_TRIALS

    def then(self, f: float) -> "TrustRegion":
        """The state after one more objective."""
        counted = replace(self, trials=self.trials + 1, best=max(self.best, f))
        if self.begins:
            return counted
        if f > self.best + _LEAST_GAIN * abs(self.best):
            return replace(counted, successes=self.successes + 1, failures=0)._resize()
        return replace(counted, successes=0, failures=self.failures + 1)._resize()

    def box(
        self, center: Float[Tensor, " D"], lengthscales: Float[Tensor, " D"]
    ) -> tuple[Float[Tensor, " D"], Float[Tensor, " D"]]:
        """Place the box in the unit cube: longer where f changes slowly, of the same volume before it is cut.

        Args:
            center: Best controller, [D].
            lengthscales: Of the fitted kernel, [D].

        Returns:
            Lower and upper corner, each [D].
        """
        weights = lengthscales / torch.exp(lengthscales.log().mean())
        return (center - weights * self.length / 2).clamp(0, 1), (center + weights * self.length / 2).clamp(
            0, 1
        )

    def _resize(self) -> "TrustRegion":
        if self.successes >= SUCCESSES:
            return replace(self, length=min(2 * self.length, LARGEST_LENGTH), successes=0)
        if self.failures < self.failures_allowed:
            return self
        if self.length / 2 < SMALLEST_LENGTH:
            return TrustRegion(self.dimensions, first=self.first + self.trials)
        return replace(self, length=self.length / 2, failures=0)
