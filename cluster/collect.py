"""`svaedc collect`: plan the missing shards, submit them to a pool of Ray actors, gather, record."""

import errno
import time
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import ray

from cluster.config import CollectSettings
from cluster.errors import UserError
from cluster.pool import Done, Failed, Limits, Pool
from cluster.progress import ProgressLine, duration, say
from cluster.quarantine import FOLDER, put_aside, quarantined, release
from cluster.rollout_actor import RolloutActor
from cluster.session import Session
from cluster.tally import Recorder, Tally
from cluster.tracking import Run, Tracker
from workers.collection import ShardReport
from workers.dataset import shards
from workers.dataset.folder import Dataset, create
from workers.dataset.identity import Identity, identity_of
from workers.dataset.publication import wait_for_end
from workers.dataset.shards import Shard
from workers.setups import Setup

_DISK = {
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES),
    *(errno.EIO, errno.ESTALE, errno.ENOTCONN),  # a network's file system that is away
}

_ENDING_SECONDS = 10.0
"""What a worker process may take to end once it was told to."""

Outcome = Done[Shard, ShardReport] | Failed[Shard]


def collect(
    *,
    setup: Setup,
    episodes: int,
    folder: Path,
    seed: int,
    repeats: int = 1,
    settings: CollectSettings,
    session: Session,
    tracker: Tracker,
) -> Dataset:
    """Bring a dataset to that many episodes; what exists already is kept and never rewritten.

    Raises:
        UserError: the folder holds another dataset, the disk is full, or shards kept failing.
    """
    identity = identity_of(setup, seed=seed, episodes_per_shard=settings.episodes_per_shard, repeats=repeats)
    dataset, plan = _plan(identity, episodes, folder)
    if not plan:
        say(f"{folder} already holds {dataset.episodes()} episodes: nothing to do")
        return dataset
    actors = min(settings.actor_count(session.cpus), len(plan))
    session.preflight(actors)
    parameters = {
        "setup": setup.name,
        "episodes": episodes,
        "seed": seed,
        "repeats": repeats,
        "bad": identity.bad_name,
        "actors": actors,
        "identity": dataset.identity.digest[:12],
        **settings.model_dump(mode="json"),
    }
    with tracker.run(f"collect {setup.name}", "collect", parameters) as run:
        tally = Tally()
        pool = _pool(dataset, settings, actors)
        try:
            with pool:
                _gather(pool.run(plan), dataset, episodes, tally, Recorder(run))
        finally:
            _clean(dataset, pool.answers)
        _record(dataset, episodes, tally, run)
    return dataset


def _plan(identity: Identity, episodes: int, folder: Path) -> tuple[Dataset, list[Shard]]:
    try:
        dataset = create(folder, identity)
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


def _clean(dataset: Dataset, writers: list[str]) -> None:
    """Leave no unfinished file behind, however the work ended."""
    wait_for_end(writers, _ENDING_SECONDS)
    shards.sweep(dataset.folder)


def _gather(
    outcomes: Iterable[Outcome], dataset: Dataset, episodes: int, tally: Tally, recorder: Recorder
) -> None:
    left = sum(shard.episodes for shard in dataset.missing(episodes))
    with ProgressLine("episodes", episodes, episodes - left) as progress:
        for outcome in outcomes:
            if isinstance(outcome, Failed):
                _note_failure(outcome, dataset, tally)
                continue
            tally.add(outcome.result)
            progress.advance(outcome.item.episodes, f"bad {tally.metrics()['badness']:.2f}")
            recorder.record(tally)


def _note_failure(failure: Failed[Shard], dataset: Dataset, tally: Tally) -> None:
    if isinstance(failure.cause, OSError) and failure.cause.errno in _DISK:
        raise _unwritable(dataset, failure.cause)
    tally.errors[failure.item].append(failure.text)
    if failure.attempts_left:
        tally.retries += 1
        say(f"{failure.item.name} failed and is tried again: {failure.error}")
        return
    try:
        path = put_aside(dataset, failure.item, tally.errors[failure.item])
    except OSError as error:
        raise _unwritable(dataset, error) from error
    say(f"{failure.item.name} was given up, its errors are in {path}: {failure.error}")


def _unwritable(dataset: Dataset, error: OSError) -> UserError:
    return UserError(
        f"cannot write to {dataset.folder}: {error.strerror}. The shards in it are safe; make room or "
        "repair the disk, and run the same command again"
    )


def _record(dataset: Dataset, episodes: int, tally: Tally, run: Run) -> None:
    """Say first how it went: the store may fail."""
    release(dataset)
    metrics = tally.metrics()
    say(
        f"{dataset.folder} holds {dataset.episodes()} episodes, {dataset.size() / 1e6:.1f} MB; "
        f"{tally.episodes} new in {duration(time.monotonic() - tally.begin)} "
        f"({metrics['episodes_per_second']:.1f}/s, {metrics['core_hours']:.2f} core-hours), "
        f"mean badness {metrics['badness']:.2f}, {tally.diverged} diverged, {tally.stopped} stopped, "
        f"{tally.retries} retries; {run.url}"
    )
    run.metrics(metrics, step=tally.episodes)
    run.dataset(dataset.identity.setup, dataset.fingerprint(), dataset.folder)
    left = quarantined(dataset, episodes)
    if left:
        raise UserError(
            f"{len(left)} shards kept failing, {left[0].name} among them; their errors are in "
            f"{dataset.folder / FOLDER}, and the same command tries them again"
        )
