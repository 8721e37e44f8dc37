"""What a task is: which steps are bad, and what the episode was worth."""

import math
from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from jaxtyping import Bool, Float32

from workers.environments.environment import Observed
from workers.user_code import UserCodeError

Bad = Bool[np.ndarray, "conditions time"] | Float32[np.ndarray, "1 time"]
"""G_bad says of every step which conditions hold, or, if it is graded, the degree in [0, 1]."""

BITS = 8
"""A step has so many bits in a dataset: at most so many bad conditions, `stopped` included."""


class Task(ABC):
    """Bad conditions and an objective over the T steps of an episode.

    Class attributes of a concrete task:
        conditions: names of the bad conditions, at most 7, for a step has 8 bits in the dataset and one
            may be `stopped`; of a graded G_bad one, the name of its degree.
        graded: whether G_bad is one row of degrees instead of one row of booleans per condition.
        bad_name: how a user's G_bad is imported; "" for the task's own.
        bad_digest: SHA-256 of the file that defines it; "" for the task's own.
    """

    conditions: tuple[str, ...]
    graded: bool = False
    bad_name: str = ""
    bad_digest: str = ""

    @abstractmethod
    def is_bad(self, observed: Observed) -> Bad:
        """G_bad of the paper; a step is as bad as its worst row."""

    @abstractmethod
    def objective(self, observed: Observed, bad: Bad) -> float:
        """Value an episode: f of the paper.

        Args:
            observed: all steps of the episode.
            bad: what `is_bad` says of them.

        Returns:
            The number that Bayesian optimisation maximises.
        """

    def clearance(self, observed: Observed) -> float:  # noqa: ARG002
        """Measure how near the robot came to what it must keep away from.

        Args:
            observed: all steps of the episode.

        Returns:
            The least distance, in m, negative where it went too far; NaN where a task does not tell.
        """
        return math.nan

    def stopped_objective(self, observed: Observed, bad: Bad) -> float:
        """Value an episode that a stop rule ended.

        Args:
            observed: the steps that were run.
            bad: what `is_bad` says of them.

        Returns:
            f of those steps, unless a task knows better.
        """
        return self.objective(observed, bad)


def check_bad(task: Task, bad: Any, steps: int) -> Bad:
    """Refuse what `is_bad` of a task returned if an episode cannot hold it.

    Args:
        task: whose `is_bad` it was.
        bad: what it returned.
        steps: that it saw.

    Returns:
        Booleans, [conditions, steps], or float32 degrees, [1, steps].

    Raises:
        UserCodeError: it has another type or shape than it must, or degrees outside [0, 1].
    """
    rows, expected = np.asarray(bad), (len(task.conditions), steps)
    kind, kinds = ("float32", "f") if task.graded else ("bool", "bui")
    if rows.dtype.kind not in kinds or rows.shape != expected:
        raise UserCodeError(
            f"{type(task).__name__}.is_bad must return {kind} of shape {expected}, one row for each of "
            f"{', '.join(task.conditions)} and one column per step, got {rows.dtype} of shape {rows.shape}; "
            "make its rows and `conditions` agree"
        )
    if not task.graded:
        return rows.astype(np.bool_, copy=False)
    outside = np.flatnonzero(~((rows[0] >= 0) & (rows[0] <= 1)))
    if outside.size:
        raise UserCodeError(
            f"{type(task).__name__}.is_bad must return degrees in [0, 1], got {rows[0, outside[0]]} in step "
            f"{outside[0]}; scale them, or clip them with np.clip(values, 0, 1)"
        )
    return rows.astype(np.float32, copy=False)


def require_objective(task: Task, f: float) -> None:
    """Refuse an objective of a task that no dataset can hold.

    Args:
        task: whose objective it is, for the error.
        f: the objective.

    Raises:
        UserCodeError: it is not a finite number.
    """
    if not math.isfinite(f):
        raise UserCodeError(
            f"the objective of {type(task).__name__} must be a finite number, got {f}; return one "
            "for every episode, the lower limit of f for one that is worth nothing"
        )
