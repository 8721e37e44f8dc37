"""Statistics of columns that are never in memory at once."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Shaped


@dataclass
class Moments:
    """Count, range, mean and spread of the columns of all rows that were added.

    Mean and spread are kept as sums of deviations (Chan, Golub and LeVeque 1983), which do not cancel.
    """

    count: int = 0
    low: np.ndarray = field(default_factory=lambda: np.array(np.inf))
    high: np.ndarray = field(default_factory=lambda: np.array(-np.inf))
    mean: np.ndarray = field(default_factory=lambda: np.array(0.0))
    deviation: np.ndarray = field(default_factory=lambda: np.array(0.0))

    def add(self, rows: Shaped[np.ndarray, "n columns"]) -> None:
        """Take further rows into account."""
        mean = rows.mean(axis=0, dtype=np.float64)
        deviation = ((rows - mean) ** 2).sum(axis=0)
        total = self.count + len(rows)
        step = mean - self.mean
        self.deviation = self.deviation + deviation + step**2 * self.count * len(rows) / total
        self.mean = self.mean + step * len(rows) / total
        self.low = np.minimum(self.low, rows.min(axis=0))
        self.high = np.maximum(self.high, rows.max(axis=0))
        self.count = total

    def as_lists(self) -> dict[str, list[float]]:
        """The statistics by the names that LeRobot gives them; the spread is that of the rows themselves."""
        return {
            "min": np.atleast_1d(self.low).astype(float).tolist(),
            "max": np.atleast_1d(self.high).astype(float).tolist(),
            "mean": np.atleast_1d(self.mean).tolist(),
            "std": np.atleast_1d(np.sqrt(self.deviation / max(self.count, 1))).tolist(),
            "count": [self.count],
        }
