"""The hidden robot of one run: it tries controller after controller, and none of them ends the run."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.failures import failure_text
from cluster.optimization.factory import outcome_of
from svaedc.bo.loop import Outcome
from workers.attempts import Attempts, SafeRollouts
from workers.isolation import IsolatedAttempts
from workers.physics import Physics
from workers.setups import Setup


@dataclass
class HiddenRobot:
    """A setup under hidden physics, which evaluates the trials of a run in their order.

    Attributes:
        folder: of the comparison.
        key: of the run.
        setup: whose controllers are tried.
        physics: hidden from the method.
        attempts: rolls out.
        next: index of the next trial.
    """

    folder: ComparisonFolder
    key: RunKey
    setup: Setup
    physics: Physics
    attempts: SafeRollouts
    next: int

    def evaluate(self, x: np.ndarray) -> Outcome:
        """Try a controller; that it is under way is noted before.

        Args:
            x: the controller, [D], in the unit cube.

        Returns:
            What it showed; a trial whose code raised, hung or ended its process has no objective.

        Raises:
            OSError: the disk takes no more, or the machine is in trouble.
        """
        self.folder.begin(self.key, self.next)
        episode = self.attempts.rollout(x, self.physics)
        if episode.failure is not None:
            name, bad = self.setup.name, self.setup.task.bad_name
            what = f"trial {self.next} of run {self.key}"
            told = failure_text(what, name, bad, x.tolist(), self.physics, episode.failure)
            self.folder.keep_failure(self.key, self.next, told)
        self.next += 1
        return outcome_of(self.setup, episode)


@contextmanager
def safe_attempts(
    folder: ComparisonFolder, key: RunKey, trials: int, attempts: Attempts, timeout: float
) -> Iterator[SafeRollouts]:
    """Chooses what rolls out the rest of a run.

    A process that ended in the middle of a trial has left its note. Whatever ended it, the rest of the run is
    rolled out where a trial can end nothing but itself.

    Args:
        folder: of the comparison.
        key: of the run.
        trials: how many of the run are recorded.
        attempts: rolls out in this process.
        timeout: longest duration of a trial, in s.

    Yields:
        These attempts, or isolated ones.
    """
    if folder.under_way(key) != trials:
        yield attempts
        return
    with IsolatedAttempts(attempts.setup, timeout) as isolated:
        yield isolated
