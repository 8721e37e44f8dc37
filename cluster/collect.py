"""`svaedc collect`: plan the missing shards, submit them to a pool of Ray actors, gather, record."""

import errno
import time
from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import ray

from cluster.config import CollectSettings
from cluster.errors import UserError
from cluster.pool import Done, Failed, Limits, Pool
from cluster.progress import ProgressLine, duration, say
from cluster.quarantine import put_aside, quarantined, release
from cluster.session import Session
from cluster.tracking import Run, Tracker
from workers import setups
from workers.collection import ShardReport, collect_shard
from workers.dataset import shards
from workers.dataset.folder import Dataset, create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.setups import Setup

_DISK = {errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES, errno.EFBIG}
_RECORD_SECONDS = 10.0

Outcome = Done[Shard, ShardReport] | Failed[Shard]


class RolloutActor:
    """A process that rolls out shards of one dataset."""

    def __init__(self, setup: str, folder: str) -> None:
        self._setup = setups.load(setup)
        self._dataset = open_dataset(Path(folder))

    def ready(self) -> None:
        """Answers once the process has started and found its dataset."""

    def collect(self, shard: Shard) -> ShardReport:
        """One shard, from its first episode to its name in the dataset."""
        return collect_shard(self._setup, self._dataset, shard)


@dataclass
class Tally:
    """What a collection has done so far."""

    episodes: int = 0
    size: int = 0
    diverged: int = 0
    bad: float = 0.0  # summed over episodes
    best: float = float("-inf")
    rollout_seconds: float = 0.0
    storage_seconds: float = 0.0
    retries: int = 0
    errors: dict[Shard, list[str]] = field(default_factory=lambda: defaultdict(list))
    begin: float = field(default_factory=time.monotonic)

    def add(self, report: ShardReport) -> None:
        """Count a finished shard."""
        self.episodes += report.shard.episodes
        self.size += report.size
        self.diverged += report.diverged
        self.bad += report.badness * report.shard.episodes
        self.best = max(self.best, report.best)
        self.rollout_seconds += report.rollout_seconds
        self.storage_seconds += report.storage_seconds

    def metrics(self) -> dict[str, float]:
        """The tally as numbers for MLflow, by name."""
        seconds = time.monotonic() - self.begin
        values = {
            "episodes": self.episodes,
            "episodes_per_second": self.episodes / max(seconds, 1e-9),
            "badness": self.bad / max(self.episodes, 1),
            "best_objective": self.best,
            "diverged": self.diverged,
            "bytes_per_episode": self.size / max(self.episodes, 1),
            "core_hours": (self.rollout_seconds + self.storage_seconds) / 3600,
            "storage_share": self.storage_seconds / max(self.rollout_seconds + self.storage_seconds, 1e-9),
            "retries": self.retries,
        }
        return {name: float(value) for name, value in values.items()}


def collect(
    *,
    setup: Setup,
    episodes: int,
    folder: Path,
    seed: int,
    settings: CollectSettings,
    session: Session,
    tracker: Tracker,
) -> Dataset:
    """Bring a dataset to that many episodes; what exists already is kept and never rewritten.

    Raises:
        UserError: the folder holds another dataset, the disk is full, or shards kept failing.
    """
    dataset, plan = _plan(setup, episodes, folder, seed, settings.episodes_per_shard)
    if not plan:
        say(f"{folder} already holds {dataset.episodes()} episodes: nothing to do")
        return dataset
    actors = min(settings.actor_count(session.cpus), len(plan))
    session.preflight(actors)
    parameters = {
        "setup": setup.name,
        "episodes": episodes,
        "seed": seed,
        "actors": actors,
        "identity": dataset.identity.digest[:12],
        **settings.model_dump(mode="json"),
    }
    with tracker.run(f"collect {setup.name}", "collect", parameters) as run:
        tally = Tally()
        with _pool(dataset, settings, actors) as pool:
            _gather(pool.run(plan), dataset, episodes, tally, run)
        _record(dataset, tally, run)
    return dataset


def _plan(
    setup: Setup, episodes: int, folder: Path, seed: int, per_shard: int
) -> tuple[Dataset, list[Shard]]:
    try:
        dataset = create(folder, identity_of(setup, seed=seed, episodes_per_shard=per_shard))
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error
    swept = shards.sweep(folder)
    if swept:
        say(f"removed {swept} unfinished files of processes that are gone")
    return dataset, dataset.missing(episodes)


def _pool(dataset: Dataset, settings: CollectSettings, actors: int) -> Pool[Shard, ShardReport]:
    remote: Any = ray.remote(RolloutActor)
    actor = remote.options(num_cpus=1, max_restarts=0, max_task_retries=0)
    return Pool(
        spawn=lambda: actor.remote(dataset.identity.setup, str(dataset.folder.resolve())),
        submit=lambda worker, shard: worker.collect.remote(shard),
        size=actors,
        limits=Limits(
            in_flight=settings.shards_in_flight_per_actor,
            attempts=settings.attempts_per_shard,
            seconds=settings.shard_timeout_seconds,
        ),
    )


def _gather(outcomes: Iterable[Outcome], dataset: Dataset, episodes: int, tally: Tally, run: Run) -> None:
    recorded = time.monotonic()
    with ProgressLine("episodes", episodes, episodes - _left(dataset, episodes)) as progress:
        for outcome in outcomes:
            if isinstance(outcome, Failed):
                _note_failure(outcome, dataset, tally)
                continue
            tally.add(outcome.result)
            release(dataset.folder, outcome.item)
            progress.advance(outcome.item.episodes, f"bad {tally.metrics()['badness']:.2f}")
            if time.monotonic() - recorded > _RECORD_SECONDS:
                recorded = time.monotonic()
                run.metrics(tally.metrics(), step=tally.episodes)


def _left(dataset: Dataset, episodes: int) -> int:
    return sum(shard.episodes for shard in dataset.missing(episodes))


def _note_failure(failure: Failed[Shard], dataset: Dataset, tally: Tally) -> None:
    if isinstance(failure.cause, OSError) and failure.cause.errno in _DISK:
        raise UserError(
            f"cannot write to {dataset.folder}: {failure.cause.strerror}. "
            f"The {dataset.episodes()} episodes in it are safe; make room and run the same command again"
        )
    tally.errors[failure.item].append(failure.error)
    if failure.attempts_left:
        tally.retries += 1
        say(f"{failure.item.name} failed and is tried again: {failure.error}")
    else:
        path = put_aside(dataset.folder, failure.item, tally.errors[failure.item])
        say(f"{failure.item.name} was given up, its errors are in {path}: {failure.error}")


def _record(dataset: Dataset, tally: Tally, run: Run) -> None:
    shards.sweep(dataset.folder)
    metrics = tally.metrics()
    run.metrics(metrics, step=tally.episodes)
    run.dataset(dataset.identity.setup, dataset.fingerprint(), dataset.folder)
    say(
        f"{dataset.folder} holds {dataset.episodes()} episodes, {dataset.size() / 1e6:.1f} MB; "
        f"{tally.episodes} new in {duration(time.monotonic() - tally.begin)} "
        f"({metrics['episodes_per_second']:.1f}/s, {metrics['core_hours']:.2f} core-hours), "
        f"mean badness {metrics['badness']:.2f}, {tally.diverged} diverged, {tally.retries} retries; "
        f"{run.url}"
    )
    left = quarantined(dataset.folder)
    if left:
        raise UserError(
            f"{len(left)} shards kept failing, {left[0]} among them; their errors are in "
            f"{dataset.folder / 'quarantine'}, and the same command tries them again"
        )
