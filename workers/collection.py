"""Collecting one shard: the whole of a rollout worker's job."""

import time
from dataclasses import dataclass

import numpy as np

from workers.dataset import schema, shards
from workers.dataset.folder import Dataset
from workers.dataset.shards import Shard
from workers.rollout import DIVERGED, random_episode
from workers.setups import MODULES, Setup


@dataclass(frozen=True)
class ShardReport:
    """What one shard was and cost.

    Attributes:
        shard: the range of episodes.
        badness: mean y.
        diverged: episodes whose simulation exploded.
        stopped: episodes that a stop rule ended.
        best: highest f.
        size: bytes on disk.
        rollout_seconds: CPU time of this process in rollouts.
        storage_seconds: CPU time in encoding, hashing and writing.
    """

    shard: Shard
    badness: float
    diverged: int
    stopped: int
    best: float
    size: int
    rollout_seconds: float
    storage_seconds: float


def require_working(setup: Setup, seed: int) -> None:
    """Roll out one episode if users supplied the robot or G_bad: their mistakes are no fault of a shard.

    Raises:
        ValueError: something in their code is not as it must be.
        OSError: a file of theirs is missing.
    """
    if setup.name not in MODULES or setup.task.bad_name:
        with setup.open() as environment:
            random_episode(setup, environment, seed, 0)


def collect_shard(setup: Setup, dataset: Dataset, shard: Shard) -> ShardReport:
    """Roll out the episodes of a shard in a fresh simulation and commit its file.

    Raises:
        OSError: when the disk is full or not writable; nothing is left behind.
    """
    begin = time.process_time()
    seed, repeats = dataset.identity.seed, dataset.identity.repeats
    with setup.open() as environment:
        episodes = [
            random_episode(setup, environment, seed, index, repeats)
            for index in range(shard.start, shard.stop)
        ]
    rolled_out = time.process_time()
    path = shards.commit(
        dataset.folder, shard, lambda target: schema.write(target, dataset.identity, shard.start, episodes)
    )
    return ShardReport(
        shard=shard,
        badness=float(np.mean([episode.y for episode in episodes])),
        diverged=sum(episode.stop == DIVERGED for episode in episodes),
        stopped=sum(episode.stop not in ("", DIVERGED) for episode in episodes),
        best=max(episode.f for episode in episodes),
        size=path.stat().st_size,
        rollout_seconds=rolled_out - begin,
        storage_seconds=time.process_time() - rolled_out,
    )
