"""Some episodes of a robot, collected as a dataset's are, and what else checks look at."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory

from workers.attempts import Attempts, SafeRollouts
from workers.collection.independence import ends
from workers.collection.shard import ShardReport, collect_shard
from workers.dataset.folder import Dataset, create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.draws import Draws
from workers.episode import FAILED, UNUSABLE, Episode
from workers.isolation import IsolatedAttempts
from workers.rollout import draw
from workers.setups import Setup

SECONDS = 10.0
"""The episodes of a sample take about so long."""
FEWEST, MOST = 8, 64
"""A sample has from so many episodes to so many."""


@dataclass(frozen=True)
class Sample:
    """Episodes 0 to n − 1 of a seed.

    Attributes:
        setup: whose episodes they are.
        seed: of their controllers and physics.
        episodes: as they were, one after the other, in a process of their own.
        dataset: that holds them, in a folder that goes with the sample.
        report: of its one shard.
        seconds: of one episode.
        timeout: longest duration of an episode, in s.
        attempts: rolls out further controllers, where whatever their code does ends no check.
    """

    setup: Setup
    seed: int
    episodes: list[Episode]
    dataset: Dataset
    report: ShardReport
    seconds: float
    timeout: float
    attempts: SafeRollouts

    @property
    def usable(self) -> dict[int, Episode]:
        """Those that neither diverged nor failed, by their index."""
        return {index: each for index, each in enumerate(self.episodes) if each.stop not in UNUSABLE}

    def affordable(self, seconds: float) -> int:
        """How many episodes go into that time."""
        return int(seconds / max(self.seconds, 1e-6))

    @cached_property
    def ends(self) -> dict[int, Episode]:
        """The first and the last usable episode, rolled out one right after the other in another process."""
        with IsolatedAttempts(self.setup, self.timeout) as attempts:
            return ends(self.setup, Draws(self.seed), dict(enumerate(self.episodes)), attempts)


@contextmanager
def sample(setup: Setup, seed: int, timeout: float, time_limit: float = SECONDS) -> Iterator[Sample]:
    """Collects a sample, and removes it afterwards.

    Args:
        setup: whose controllers are rolled out.
        seed: of their controllers and physics.
        timeout: longest duration of an episode, in s.
        time_limit: the episodes take about so long, in s.

    Yields:
        From `FEWEST` to `MOST` episodes.
    """
    with TemporaryDirectory(prefix="svaedc-check-") as folder, IsolatedAttempts(setup, timeout) as attempts:
        episodes = attempts.rollouts(draw(setup, seed, index) for index in range(FEWEST))
        seconds = _seconds(setup, seed, episodes, timeout)
        count = min(max(FEWEST, int(time_limit / max(seconds, 1e-6))), MOST)
        episodes += attempts.rollouts(draw(setup, seed, index) for index in range(FEWEST, count))
        dataset = create(Path(folder), identity_of(setup, seed=seed, episodes_per_shard=count))
        report = collect_shard(setup, dataset, Shard(0, count), lambda *_: episodes)
        yield Sample(setup, seed, episodes, dataset, report, seconds, timeout, attempts)


def _seconds(setup: Setup, seed: int, episodes: Sequence[Episode], timeout: float) -> float:
    """What one of these episodes takes in this process, if none of them can do it any harm."""
    if any(episode.stop == FAILED for episode in episodes):
        return timeout
    with Attempts(setup) as attempts:
        attempts.rollout(*draw(setup, seed, 0))  # opens the environment, too
        begin = time.monotonic()
        attempts.rollouts(draw(setup, seed, index) for index in range(1, len(episodes)))
        return (time.monotonic() - begin) / (len(episodes) - 1)
