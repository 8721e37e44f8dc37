"""The work of a collection: submit shards to a pool of actors, gather what they report, clean up."""

import sys
from collections import deque
from collections.abc import Iterable, Sequence
from typing import Any

import ray

from cluster.config import CollectSettings
from cluster.datasets.plan import CollectionPlan, episodes_in
from cluster.datasets.progress import CollectionProgress, ProgressRecorder
from cluster.datasets.quarantine import ACCOUNTS, keep_account, put_aside
from cluster.datasets.worker import RolloutActor
from cluster.errors import UserError
from cluster.files import DISK_ERRORS
from cluster.progress import ProgressLine, say
from cluster.runtime.actor_pool import Done, Failed, Limits, Pool
from cluster.tracking import Run
from workers.collection.shard import ShardReport
from workers.dataset.folder import Dataset
from workers.dataset.inventory import sweep_digests
from workers.dataset.shards import Shard, sweep
from workers.dataset.storage.temporary import wait_for_end

_ENDING_SECONDS = 10.0
"""A worker process may take so long to end once it was told to."""

LAST_REPORTS = 1024
"""So many reports are kept; a plan is made from fewer."""

Outcome = Done[Shard, ShardReport] | Failed[Shard]


def growth(settings: CollectSettings) -> int:
    """How many actors there may be as CPUs become free: as many as are asked for."""
    return sys.maxsize if settings.actors == "all" else settings.actors


def rollout_pool(
    dataset: Dataset,
    settings: CollectSettings,
    actors: int,
    actor: type[RolloutActor] = RolloutActor,
    most: int = 0,
) -> Pool[Shard, ShardReport]:
    """Make a pool of actors that roll out shards of a dataset, one CPU each.

    Args:
        dataset: to which the shards belong.
        settings: of the collection.
        actors: how many there are at first.
        actor: class of the rollout processes.
        most: how many there may be, as CPUs become free; `actors` if that is more.

    Returns:
        The pool, whose actors start when it runs.
    """
    remote: Any = ray.remote(actor)
    options = remote.options(num_cpus=1, max_restarts=0, max_task_retries=0)
    return Pool(
        spawn=lambda: options.remote(
            dataset.identity.setup, str(dataset.folder.resolve()), settings.episode_timeout_seconds
        ),
        submit=_submit,
        size=actors,
        limits=Limits(
            in_flight=settings.shards_in_flight_per_actor,
            attempts=settings.attempts_per_shard,
            seconds=settings.shard_timeout_seconds,
        ),
        most=most,
    )


def _submit(worker: Any, shard: Shard, deaths: int) -> Any:
    """A shard that ended a process is rolled out where its episodes can end one each."""
    return worker.collect_isolated.remote(shard) if deaths else worker.collect.remote(shard)


def roll_out(
    plan: CollectionPlan,
    shards: Sequence[Shard],
    counts: CollectionProgress,
    run: Run,
    pool: Pool[Shard, ShardReport],
) -> list[ShardReport]:
    """Collect some shards of a plan.

    Args:
        plan: of the collection.
        shards: of it.
        counts: what is done so far; they are added to.
        run: of MLflow, which is told now and then.
        pool: of actors that roll out.

    Returns:
        The reports of the last shards, `LAST_REPORTS` at most.

    Raises:
        UserError: the disk is full, or no actor can start.
    """
    try:
        with pool:
            return _gather(pool.run(list(shards)), plan, counts, ProgressRecorder(run))
    finally:
        _clean(plan.dataset, pool.answers)


def _clean(dataset: Dataset, writers: list[str]) -> None:
    """Leave no unfinished file behind, however the work ended."""
    wait_for_end(writers, _ENDING_SECONDS)
    try:
        sweep(dataset.folder)
        sweep_digests(dataset)
    except OSError as error:  # a store that is away; how the work ended matters more
        say(f"unfinished files may be left in {dataset.folder}, which the next collection removes: {error}")


def _gather(
    outcomes: Iterable[Outcome], plan: CollectionPlan, counts: CollectionProgress, recorder: ProgressRecorder
) -> list[ShardReport]:
    reports: deque[ShardReport] = deque(maxlen=LAST_REPORTS)
    done = plan.episodes - episodes_in(plan.missing)
    with ProgressLine("episodes", plan.episodes, done) as progress:
        for outcome in outcomes:
            if isinstance(outcome, Failed):
                note_failure(outcome, plan.dataset, counts)
                continue
            note_report(outcome.result, plan.dataset, counts)
            reports.append(outcome.result)
            progress.advance(outcome.item.episodes, counts.note())
            recorder.record(counts)
    return list(reports)


def note_report(report: ShardReport, dataset: Dataset, counts: CollectionProgress) -> None:
    """Count a finished shard, and say at once what its user wants to know before the others are rolled out.

    Args:
        report: of the shard.
        dataset: to which it belongs.
        counts: of the collection, which are added to.

    Raises:
        UserError: the disk takes no more.
    """
    told = counts.failed
    counts.add(report)
    if report.leak:
        say(f"warning: {report.leak}")
    for failed in report.failures[: max(0, ACCOUNTS - told)]:
        try:
            path = keep_account(dataset, failed)
        except OSError as error:
            raise _unwritable(dataset, error) from error
        if not told:
            say(f"episode {failed.index} failed alone, all about it is in {path}: {failed.failure.reason}")
        told += 1


def note_failure(failure: Failed[Shard], dataset: Dataset, counts: CollectionProgress) -> None:
    """Say it, keep its error, and put the shard aside after its last attempt.

    Args:
        failure: of one attempt.
        dataset: to which the shard belongs.
        counts: of the collection; its errors and retries are added to.

    Raises:
        UserError: it is the disk's fault, which no further attempt changes.
    """
    if isinstance(failure.cause, OSError) and failure.cause.errno in DISK_ERRORS:
        raise _unwritable(dataset, failure.cause)
    counts.errors[failure.item].append(failure.text)
    if failure.attempts_left:
        counts.retries += 1
        say(f"{failure.item.name} failed and is tried again: {failure.error}")
        return
    try:
        path = put_aside(dataset, failure.item, counts.errors[failure.item])
    except OSError as error:
        raise _unwritable(dataset, error) from error
    say(f"{failure.item.name} was given up, its errors are in {path}: {failure.error}")


def _unwritable(dataset: Dataset, error: OSError) -> UserError:
    return UserError(
        f"cannot write to {dataset.folder}: {error.strerror}. The shards in it are safe; make room, "
        "or let it be written to, and run the same command again"
    )
