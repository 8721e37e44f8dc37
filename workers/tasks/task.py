"""What a task is: which steps are bad, and what the episode was worth."""

from abc import ABC, abstractmethod

import numpy as np
from jaxtyping import Bool, Float32

from workers.environments.environment import Observed

Bad = Bool[np.ndarray, "conditions time"] | Float32[np.ndarray, "1 time"]
"""What G_bad says of every step: which conditions hold, or, of a graded one, the degree in [0, 1]."""


class Task(ABC):
    """Bad conditions and an objective over the T steps of an episode.

    Class attributes of a concrete task:
        conditions: names of the bad conditions, at most 7, for a step has 8 bits in the dataset and one
            may be `stopped`.
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
        """f, the number Bayesian optimisation maximises."""

    def stopped_objective(self, observed: Observed, bad: Bad) -> float:
        """The objective of an episode that a stop rule ended: f of the steps it ran, which are `observed`."""
        return self.objective(observed, bad)
