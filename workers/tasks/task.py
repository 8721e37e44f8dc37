"""What a task is: which steps are bad, and what the episode was worth."""

from abc import ABC, abstractmethod

import numpy as np
from jaxtyping import Bool

from workers.environments.environment import Observed


class Task(ABC):
    """Bad conditions and an objective over the T steps of an episode.

    Class attributes of a concrete task:
        conditions: names of the bad conditions, at most 7, for a step has 8 bits in the dataset and one
            may be `stopped`.
    """

    conditions: tuple[str, ...]

    @abstractmethod
    def is_bad(self, observed: Observed) -> Bool[np.ndarray, "conditions time"]:
        """G_bad of the paper, one row per condition; a step is bad when any of them holds."""

    @abstractmethod
    def objective(self, observed: Observed, bad: Bool[np.ndarray, "conditions time"]) -> float:
        """f, the number Bayesian optimisation maximises."""

    def stopped_objective(self, observed: Observed, bad: Bool[np.ndarray, "conditions time"]) -> float:
        """The objective of an episode that a stop rule ended: f of the steps it ran, which are `observed`."""
        return self.objective(observed, bad)
