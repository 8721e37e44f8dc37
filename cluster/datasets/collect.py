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
from workers.collection.forecast import forecast, pilot_of
from workers.dataset.folder import Dataset
from workers.dataset.notes import notes
from workers.dataset.storage.presence import others_at_work, presence


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
    warn_of_others(dataset)
    with (
        presence(dataset.folder),
        tracker.run(f"collect {dataset.identity.setup}", "collect", plan.parameters(actors, settings)) as run,
    ):
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
    pilot = pilot_of(missing, actors)
    if len(pilot) < 2:
        raise UserError(
            f"{episodes_in(missing)} episodes are left to collect in {dataset.folder}: too few to plan for; "
            "leave out --plan"
        )
    session.preflight(actors)
    warn_of_others(dataset)
    with (
        presence(dataset.folder),
        tracker.run(f"plan {dataset.identity.setup}", "plan", plan.parameters(actors, settings)) as run,
    ):
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


def warn_of_others(dataset: Dataset) -> None:
    """Say that another command collects into the same folder: what both roll out is kept once."""
    for path in others_at_work(dataset.folder):
        say(
            f"warning: another collection is at work in {dataset.folder}: what both roll out is kept once, "
            f"so this one may find little to do. If there is none any more, remove {path}"
        )


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
