"""`svaedc collect`: collect what is missing in a dataset and record it, or foretell what that will cost."""

from collections.abc import Mapping, Sequence
from typing import Any

from cluster.config import CollectSettings
from cluster.datasets.gather import growth, open_and_plan, rollout_pool, work
from cluster.datasets.pilot import add_cost, begin, metrics, plan_text, review
from cluster.datasets.progress import CollectionProgress
from cluster.datasets.quarantine import FOLDER, quarantined_shards, release
from cluster.datasets.worker import RolloutActor
from cluster.errors import UserError
from cluster.progress import duration, say
from cluster.runtime.session import Session
from cluster.tracking import Run, Tracker
from workers.collection.forecast import forecast
from workers.dataset.folder import Dataset
from workers.dataset.identity import Identity, identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.location import Location
from workers.setups import Setup

PILOT_SHARDS = 4
"""A plan rolls out that many shards, or two on every actor if that is more."""


def collect(
    *,
    setup: Setup,
    episodes: int,
    folder: Location,
    seed: int,
    repeats: int = 1,
    settings: CollectSettings,
    session: Session,
    tracker: Tracker,
    actor: type[RolloutActor] = RolloutActor,
) -> Dataset:
    """Bring a dataset to that many episodes; what exists already is kept and never rewritten.

    Raises:
        UserError: the folder holds another dataset, the disk is full, or shards kept failing.
    """
    identity = _identity(setup, seed, repeats, settings)
    dataset, plan = open_and_plan(identity, episodes, folder)
    if not plan:
        release(dataset)  # a driver that was killed at its end may have put aside what another collected
        say(f"{folder} already holds {dataset.episodes()} episodes: nothing to do")
        return dataset
    actors = min(settings.actor_count(session.cpus), len(plan))
    session.preflight(actors)
    parameters = _parameters(identity, episodes, actors, settings)
    with tracker.run(f"collect {setup.name}", "collect", parameters) as run:
        counts = CollectionProgress(planned=_size(plan))
        pool = rollout_pool(dataset, settings, actors, actor, growth(settings))
        try:
            work(dataset, plan, episodes, counts, run, pool)
        finally:
            add_cost(dataset, counts, pool.actor_seconds)
        _record(dataset, episodes, counts, run)
    return dataset


def foretell(
    *,
    setup: Setup,
    episodes: int,
    folder: Location,
    seed: int,
    repeats: int = 1,
    settings: CollectSettings,
    session: Session,
    tracker: Tracker,
) -> None:
    """Collect the first few shards of a dataset, and say what all of it will cost.

    Raises:
        UserError: as `collect` does, or too little is left to collect.
    """
    identity = _identity(setup, seed, repeats, settings)
    dataset, plan = open_and_plan(identity, episodes, folder)
    actors = min(settings.actor_count(session.cpus), len(plan))
    pilot = plan[: max(PILOT_SHARDS, 2 * actors)]
    if len(pilot) < 2:
        raise UserError(
            f"{_size(plan)} episodes are left to collect in {folder}: too few to plan for; leave out --plan"
        )
    session.preflight(actors)
    parameters = _parameters(identity, episodes, actors, settings)
    with tracker.run(f"plan {setup.name}", "plan", parameters) as run:
        counts = CollectionProgress(planned=_size(pilot))
        reports = work(dataset, pilot, episodes, counts, run, rollout_pool(dataset, settings, actors))
        if len(reports) < 2:
            raise UserError(
                f"{len(pilot) - len(reports)} of {len(pilot)} shards kept failing, so there is no plan; "
                f"their errors are in {dataset.folder / FOLDER}, and the same command tries them again"
            )
        expected = forecast(reports, _size(plan), actors)
        begin(dataset, episodes, expected, counts)
        say(plan_text(expected, _size([report.shard for report in reports])))
        run.metrics(counts.metrics() | metrics(expected), step=counts.episodes)


def _identity(setup: Setup, seed: int, repeats: int, settings: CollectSettings) -> Identity:
    return identity_of(
        setup,
        seed=seed,
        episodes_per_shard=settings.episodes_per_shard,
        repeats=repeats,
        storage=settings.storage,
    )


def _parameters(
    identity: Identity, episodes: int, actors: int, settings: CollectSettings
) -> Mapping[str, Any]:
    return {
        "setup": identity.setup,
        "episodes": episodes,
        "seed": identity.seed,
        "repeats": identity.repeats,
        "bad": identity.bad_name,
        "actors": actors,
        "identity": identity.digest[:12],
        **settings.model_dump(mode="json"),
    }


def _size(plan: Sequence[Shard]) -> int:
    return sum(shard.episodes for shard in plan)


def _record(dataset: Dataset, episodes: int, counts: CollectionProgress, run: Run) -> None:
    """Say first how it went: the store may fail."""
    release(dataset)
    say(
        f"{dataset.folder} holds {dataset.episodes()} episodes, {dataset.size() / 1e6:.1f} MB; "
        f"{counts.episodes} new in {duration(counts.seconds)} "
        f"({counts.rate:.1f}/s, {counts.core_seconds / 3600:.2f} core-hours), "
        f"mean badness {counts.badness:.2f}, {counts.diverged} diverged, "
        f"{counts.stopped} stopped, {counts.retries} retries; {run.url}"
    )
    run.metrics(counts.metrics() | review(dataset), step=counts.episodes)
    run.dataset(dataset.identity.setup, dataset.fingerprint(), dataset.folder)
    left = quarantined_shards(dataset, episodes)
    if left:
        raise UserError(
            f"{len(left)} shards kept failing, {left[0].name} among them; their errors are in "
            f"{dataset.folder / FOLDER}, and the same command tries them again"
        )
