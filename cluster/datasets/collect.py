"""`svaedc collect`: collect what a dataset misses and record it, or say from a few shards what that costs."""

from cluster.config import CollectSettings
from cluster.datasets.gather import growth, roll_out, rollout_pool
from cluster.datasets.pilot import add_cost, begin, metrics, plan_text, review
from cluster.datasets.plan import CollectionPlan, episodes_in, say_complete
from cluster.datasets.progress import CollectionProgress
from cluster.datasets.quarantine import FOLDER, quarantined_shards, release
from cluster.datasets.worker import RolloutActor
from cluster.errors import UserError
from cluster.progress import duration, say
from cluster.runtime.session import Session
from cluster.tracking import Run, Tracker
from workers.collection.forecast import forecast
from workers.dataset.folder import Dataset
from workers.dataset.notes import notes

PILOT_SHARDS = 4
"""A plan rolls out that many shards, or two on every actor if that is more."""


def collect(
    plan: CollectionPlan,
    settings: CollectSettings,
    session: Session,
    tracker: Tracker,
    actor: type[RolloutActor] = RolloutActor,
) -> Dataset:
    """Bring a dataset to the episodes of a plan; what exists already is kept and never rewritten.

    Args:
        plan: what is missing.
        settings: of the collection.
        session: where the actors run.
        tracker: that records it.
        actor: class of the rollout processes.

    Returns:
        The dataset.

    Raises:
        UserError: the cluster has no room, the disk is full, or shards kept failing.
    """
    dataset, missing = plan.dataset, plan.missing
    if not missing:
        say_complete(plan)
        return dataset
    actors = min(settings.actor_count(session.cpus), len(missing))
    session.preflight(actors)
    with tracker.run(
        f"collect {dataset.identity.setup}", "collect", plan.parameters(actors, settings)
    ) as run:
        counts = CollectionProgress(planned=episodes_in(missing))
        pool = rollout_pool(dataset, settings, actors, actor, growth(settings))
        try:
            roll_out(plan, missing, counts, run, pool)
        finally:
            add_cost(dataset, counts, pool.actor_seconds)
        _record(plan, counts, run)
    return dataset


def collect_pilot(
    plan: CollectionPlan, settings: CollectSettings, session: Session, tracker: Tracker
) -> None:
    """Collect the first few shards of a plan, and say what all of it will cost.

    Args:
        plan: what is missing.
        settings: of the collection.
        session: where the actors run.
        tracker: that records it.

    Raises:
        UserError: as `collect` does, or too little is left to collect.
    """
    dataset, missing = plan.dataset, plan.missing
    actors = min(settings.actor_count(session.cpus), len(missing))
    pilot = missing[: max(PILOT_SHARDS, 2 * actors)]
    if len(pilot) < 2:
        raise UserError(
            f"{episodes_in(missing)} episodes are left to collect in {dataset.folder}: too few to plan for; "
            "leave out --plan"
        )
    session.preflight(actors)
    with tracker.run(f"plan {dataset.identity.setup}", "plan", plan.parameters(actors, settings)) as run:
        counts = CollectionProgress(planned=episodes_in(pilot))
        reports = roll_out(plan, pilot, counts, run, rollout_pool(dataset, settings, actors))
        if len(reports) < 2:
            raise UserError(
                f"{len(pilot) - len(reports)} of {len(pilot)} shards kept failing, so there is no plan; "
                f"their errors are in {dataset.folder / FOLDER}, and the same command tries them again"
            )
        expected = forecast(reports, episodes_in(missing), actors)
        begin(dataset, plan.episodes, expected, counts)
        say(plan_text(expected, episodes_in([report.shard for report in reports])))
        run.metrics(counts.metrics() | metrics(expected), step=counts.episodes)


def _record(plan: CollectionPlan, counts: CollectionProgress, run: Run) -> None:
    """Say first how it went: the store may fail."""
    dataset = plan.dataset
    release(dataset)
    say(
        f"{dataset.folder} holds {dataset.episodes()} episodes, {dataset.size() / 1e6:.1f} MB; "
        f"{counts.episodes} new in {duration(counts.seconds)} "
        f"({counts.rate:.1f}/s, {counts.core_seconds / 3600:.2f} core-hours), "
        f"mean badness {counts.badness:.2f}, {counts.diverged} diverged, "
        f"{counts.stopped} stopped, {counts.failed_text}{counts.retries} retries; {run.url}"
    )
    for note in notes(dataset):
        say(f"note: {note}")
    run.metrics(counts.metrics() | review(dataset), step=counts.episodes)
    run.dataset(dataset.identity.setup, dataset.fingerprint(), dataset.folder)
    left = quarantined_shards(dataset, plan.episodes)
    if left:
        raise UserError(
            f"{len(left)} shards kept failing, {left[0].name} among them; their errors are in "
            f"{dataset.folder / FOLDER}, and the same command tries them again"
        )
