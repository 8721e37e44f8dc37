"""The trials of one run so far: which controllers were tried, and what each was worth."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float


def _no_controllers() -> Float[np.ndarray, "0 0"]:
    return np.empty((0, 0))


@dataclass(frozen=True, eq=False)
class History:
    """All that a method may know about a run.

    Attributes:
        x: Controllers measured, each in the unit cube, in the order of their trials.
        f: Objective of each.
        failed: Controllers that were tried and gave no objective. They teach a surrogate nothing, but a
            method that may not repeat itself must know them.
    """

    x: Float[np.ndarray, "n D"]
    f: Float[np.ndarray, " n"]
    failed: Float[np.ndarray, "m _"] = field(default_factory=_no_controllers)

    def __post_init__(self) -> None:
        """Refuses what is no history, and keeps read-only copies, so that a method cannot change its past."""
        x, f, failed = (np.array(value, dtype=np.float64) for value in (self.x, self.f, self.failed))
        if x.ndim != 2 or f.shape != x.shape[:1]:
            raise ValueError(f"x must be [n, D] and f [n], got {x.shape} and {f.shape}")
        failed = failed if failed.size else np.empty((0, x.shape[1]))
        if failed.ndim != 2 or failed.shape[1] != x.shape[1]:
            raise ValueError(f"failed must be [m, {x.shape[1]}] like x, got {failed.shape}")
        tried = np.concatenate([x, failed])
        if not ((tried >= 0) & (tried <= 1)).all():
            raise ValueError(f"every controller must lie in the unit cube, got {_first_outside(tried)}")
        if not np.isfinite(f).all():
            raise ValueError(
                f"every objective must be finite, got {f[~np.isfinite(f)][0]}: put its controller in `failed`"
            )
        for name, value in (("x", x), ("f", f), ("failed", failed)):
            value.setflags(write=False)
            object.__setattr__(self, name, value)

    @classmethod
    def empty(cls, dimensions: int) -> "History":
        """A run before its first trial.

        Args:
            dimensions: D, the number of controller parameters.
        """
        return cls(np.empty((0, dimensions)), np.empty(0))

    def __len__(self) -> int:
        return len(self.f)

    @property
    def tried(self) -> Float[np.ndarray, "t D"]:
        """Every controller a trial was spent on, measured ones first."""
        return np.concatenate([self.x, self.failed])

    def append(self, x: Float[np.ndarray, " D"], f: float) -> "History":
        """Add one more trial.

        Args:
            x: Its controller in the unit cube, [D].
            f: Its objective; NaN if it gave none, and then the controller counts as failed.

        Returns:
            A new history; this one stays as it is.
        """
        if np.isnan(f):
            return History(self.x, self.f, np.concatenate([self.failed, x[None]]))
        return History(np.concatenate([self.x, x[None]]), np.append(self.f, f), self.failed)


def _first_outside(x: Float[np.ndarray, "n D"]) -> str:
    row = x[~((x >= 0) & (x <= 1)).all(axis=1)][0]
    return np.array2string(row, threshold=8, precision=4)
