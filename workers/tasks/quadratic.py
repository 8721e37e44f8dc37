"""The two quadratics of appendix C, to be maximised over the unit cube."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool

from workers.environments.environment import Observed
from workers.tasks.task import Bad, Task

SLOPE = 0.001
"""The objective grows by so much along each coordinate that hardly matters (appendix C)."""


@dataclass(frozen=True)
class Quadratic(Task):
    """f(x) = Σ_{i ≤ d} (x_i + 1)² + 0.001 Σ_{i > d} x_i of the last place, in float64.

    Attributes:
        dimensions: D, coordinates of x.
        intrinsic: d, how many of them matter; D for Σ_i (x_i + 1)² alone.
    """

    dimensions: int
    intrinsic: int
    conditions: tuple[str, ...] = field(default=("outside_unit_cube",), init=False)

    def __post_init__(self) -> None:
        """Refuse more coordinates that matter than there are."""
        if not 1 <= self.intrinsic <= self.dimensions:
            raise ValueError(
                f"intrinsic must lie between 1 and dimensions {self.dimensions}, got {self.intrinsic}"
            )

    @property
    def objective_limits(self) -> tuple[float, float]:
        """The least and the greatest value of f, at the corners 0 and 1."""
        return float(self.intrinsic), 4.0 * self.intrinsic + SLOPE * (self.dimensions - self.intrinsic)

    def is_bad(self, observed: Observed) -> Bool[np.ndarray, "conditions time"]:
        """A formula has no bad steps; the one condition, x outside the unit cube, cannot come about."""
        return np.any((observed.xi < 0.0) | (observed.xi > 1.0), axis=0, keepdims=True)

    def objective(self, observed: Observed, bad: Bad) -> float:  # noqa: ARG002
        """Evaluate the formula of the class at the last step.

        Args:
            observed: all steps of the episode.
            bad: not looked at.

        Returns:
            f.
        """
        x = observed.xi[:, -1].astype(np.float64)
        return float(((x[: self.intrinsic] + 1) ** 2).sum() + SLOPE * x[self.intrinsic :].sum())
