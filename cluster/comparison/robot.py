"""The hidden robot of one run: it tries controller after controller, and none of them ends the run."""

from dataclasses import dataclass

import numpy as np

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.failures import failure_text
from cluster.optimization import outcome_of
from svaedc.bo.loop import Outcome
from workers.attempts import Attempts
from workers.isolation import IsolatedAttempts
from workers.physics import Physics
from workers.rollout import Episode
from workers.setups import Setup


@dataclass
class HiddenRobot:
    """A setup under hidden physics, which evaluates the trials of a run in their order.

    It notes which trial is under way. The process that goes on after one that ended meanwhile sees the note,
    and evaluates that trial where it can end nothing but itself.

    Attributes:
        folder: of the comparison.
        key: of the run.
        setup: whose controllers are tried.
        physics: hidden from the method.
        attempts: rolls out in this process.
        timeout: longest duration of a trial, in s.
        next: index of the next trial.
    """

    folder: ComparisonFolder
    key: RunKey
    setup: Setup
    physics: Physics
    attempts: Attempts
    timeout: float
    next: int

    def evaluate(self, x: np.ndarray) -> Outcome:
        """Try a controller.

        Args:
            x: the controller, [D], in the unit cube.

        Returns:
            What it showed; a trial whose code raised, hung or ended its process has no objective.

        Raises:
            OSError: the disk takes no more, or the machine is in trouble.
        """
        episode = self._try_isolated(x) if self.folder.under_way(self.key) == self.next else self._try(x)
        if episode.failure is not None:
            what = f"trial {self.next} of run {self.key}"
            told = failure_text(what, self.setup.name, "", x.tolist(), self.physics, episode.failure)
            self.folder.keep_failure(self.key, self.next, told)
        self.next += 1
        return outcome_of(self.setup, episode)

    def _try(self, x: np.ndarray) -> Episode:
        self.folder.begin(self.key, self.next)
        return self.attempts.rollout(x, self.physics)

    def _try_isolated(self, x: np.ndarray) -> Episode:
        with IsolatedAttempts(self.setup, self.timeout) as attempts:
            return attempts.rollout(x, self.physics)
