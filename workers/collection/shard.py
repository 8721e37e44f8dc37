"""Collecting one shard: the whole of a rollout worker's job."""

import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workers.dataset import schema, shards
from workers.dataset.folder import Dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import host
from workers.rollout import DIVERGED, Episode, random_episode
from workers.setups import SETUPS, Setup


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
        seconds: wall time of both.
        machine: the host name of the machine that did it.
    """

    shard: Shard
    badness: float
    diverged: int
    stopped: int
    best: float
    size: int
    rollout_seconds: float
    storage_seconds: float
    seconds: float
    machine: str


def require_working(setup: Setup, seed: int) -> None:
    """Roll out one episode if users supplied the robot or G_bad: their mistakes are no fault of a shard.

    Args:
        setup: what is tried.
        seed: of the dataset; its episode 0 is the one rolled out.

    Raises:
        ValueError: something in their code is not as it must be, such as the shape of what G_bad returns, or
            an objective that is no finite number.
        OSError: a file of theirs is missing.
    """
    if setup.name not in SETUPS or setup.task.bad_name:
        with setup.open() as environment:
            random_episode(setup, environment, seed, 0)


def roll_out(setup: Setup, dataset: Dataset, shard: Shard) -> list[Episode]:
    """Roll out the episodes of a shard, in a fresh simulation.

    Args:
        setup: of the dataset.
        dataset: whose seed and repeats hold.
        shard: which episodes.

    Returns:
        The episodes, in the order of their indices.
    """
    seed, repeats = dataset.identity.seed, dataset.identity.repeats
    with setup.open() as environment:
        return [
            random_episode(setup, environment, seed, index, repeats)
            for index in range(shard.start, shard.stop)
        ]


def collect_shard(
    setup: Setup,
    dataset: Dataset,
    shard: Shard,
    roll_out: Callable[[Setup, Dataset, Shard], list[Episode]] = roll_out,
) -> ShardReport:
    """Roll out the episodes of a shard and commit its file.

    Args:
        setup: of the dataset.
        dataset: to which the shard belongs.
        shard: which episodes.
        roll_out: makes them.

    Returns:
        What the shard was and cost.

    Raises:
        OSError: when the disk is full or not writable; nothing is left behind.
    """
    started, begin = time.monotonic(), time.process_time()
    episodes = roll_out(setup, dataset, shard)
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
        seconds=time.monotonic() - started,
        machine=host(),
    )


def require_same_code(setup: Setup, dataset: Dataset) -> None:
    """Refuse to roll out where the episodes would differ from those that the dataset promises.

    Args:
        setup: as this machine has it.
        dataset: whose identity it must have.

    Raises:
        ValueError: naming this machine, and what differs in its code or libraries.
    """
    asked = dataset.identity
    own = identity_of(
        setup,
        seed=asked.seed,
        episodes_per_shard=asked.episodes_per_shard,
        repeats=asked.repeats,
        storage=asked.storage,
    )
    differences = asked.differences(own)
    if differences:
        raise ValueError(
            f"the machine {host()} would roll out other episodes than {dataset.folder} holds; the two differ "
            f"in {'; '.join(differences)}. Install the same svaedc and libraries on every machine"
        )
