"""Collecting one shard: the whole of a rollout worker's job."""

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from workers.attempts import Attempts, SafeRollouts, Watchdog
from workers.collection.independence import order_dependence
from workers.dataset import schema, shards
from workers.dataset.folder import Dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import host
from workers.episode import DIVERGED, FAILED, UNUSABLE, Episode, Failure
from workers.physics import Physics
from workers.rollout import draw, rollout, storable
from workers.setups import SETUPS, Setup
from workers.tasks.task import require_objective
from workers.user_code import UserCodeError, describe

KEPT_FAILURES = 8
"""A report tells of so many failed episodes in full; of the others it has the number."""


@dataclass(frozen=True)
class FailedEpisode:
    """An episode that came to no end.

    Attributes:
        index: of the episode.
        x: the controller, D numbers in [0, 1].
        physics: that it ran under.
        failure: what it failed of.
    """

    index: int
    x: tuple[float, ...]
    physics: Physics
    failure: Failure


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
        failed: episodes that raised, hung or ended their process.
        failures: the first of them, in full.
        leak: how an episode differs when it is rolled out in another order; "" where it does not, or was
            not tried.
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
    failed: int = 0
    failures: tuple[FailedEpisode, ...] = ()
    leak: str = ""


RollOut = Callable[[Setup, Dataset, Shard], list[Episode]]
"""It makes the episodes of a shard, in the order of their indices."""


def require_working(setup: Setup, seed: int) -> None:
    """Roll out one episode if users supplied the robot or G_bad: their mistakes are no fault of a shard.

    An episode that hangs ends this process, with a traceback that shows where.

    Args:
        setup: what is tried.
        seed: of the dataset; its episode 0 is the one rolled out.

    Raises:
        UserCodeError: something in their code is not as it must be, such as the shape of what G_bad returns,
            or an objective that is no finite number; or it raised, and the message says what and where.
        OSError: a file of theirs is missing.
    """
    if not is_of_users(setup):
        return
    try:
        with Watchdog() as watchdog, setup.open() as environment:
            watchdog.watch()
            episode = rollout(setup, environment, *draw(setup, seed, 0))
        require_objective(setup.task, episode.f)
    except (UserCodeError, OSError):
        raise
    except Exception as error:  # users' code may raise anything
        raise UserCodeError(
            f"{setup.name} does not work: episode 0 of seed {seed} raised {describe(error)}"
        ) from error


def is_of_users(setup: Setup) -> bool:
    """Whether users supplied the robot or its G_bad."""
    return setup.name not in SETUPS or bool(setup.task.bad_name)


def roll_out(
    setup: Setup,
    dataset: Dataset,
    shard: Shard,
    attempts: Callable[[Setup], SafeRollouts] = Attempts,
) -> list[Episode]:
    """Roll out the episodes of a shard, in a fresh simulation.

    Args:
        setup: of the dataset.
        dataset: whose draws they are.
        shard: which episodes.
        attempts: rolls them out, in this process or in one of their own.

    Returns:
        The episodes, in the order of their indices; those whose code raised have failed, and say why.
    """
    draws = dataset.draws()
    with attempts(setup) as trying:
        episodes = trying.rollouts(draws.episode(setup, index) for index in range(shard.start, shard.stop))
    return [storable(setup, episode) for episode in episodes]


def collect_shard(setup: Setup, dataset: Dataset, shard: Shard, roll_out: RollOut = roll_out) -> ShardReport:
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
    stops = [episode.stop for episode in episodes]
    return ShardReport(
        shard=shard,
        badness=float(np.mean([episode.y for episode in episodes])),
        diverged=stops.count(DIVERGED),
        stopped=sum(stop not in UNUSABLE | {""} for stop in stops),
        failed=stops.count(FAILED),
        failures=tuple(_failures(shard, episodes))[:KEPT_FAILURES],
        leak=_leak(setup, dataset, shard, episodes),
        best=max(episode.f for episode in episodes),
        size=path.stat().st_size,
        rollout_seconds=rolled_out - begin,
        storage_seconds=time.process_time() - rolled_out,
        seconds=time.monotonic() - started,
        machine=host(),
    )


def _failures(shard: Shard, episodes: list[Episode]) -> Iterator[FailedEpisode]:
    for index, episode in enumerate(episodes, start=shard.start):
        if episode.failure is not None:
            yield FailedEpisode(index, tuple(episode.x.tolist()), episode.physics, episode.failure)


def _leak(setup: Setup, dataset: Dataset, shard: Shard, episodes: list[Episode]) -> str:
    """Try episodes of a dataset's first shard in another order, if users supplied the robot."""
    if shard.start or not is_of_users(setup):
        return ""
    return order_dependence(setup, dataset.draws(), shard.start, episodes)


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
        gap=asked.gap,
        physics_of=asked.physics_of,
        chosen=asked.chosen,
        storage=asked.storage,
    )
    differences = asked.differences(own)
    if differences:
        raise ValueError(
            f"the machine {host()} would roll out other episodes than {dataset.folder} holds; the two differ "
            f"in {'; '.join(differences)}. Install the same svaedc and libraries on every machine"
        )
