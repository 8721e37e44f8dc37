"""Runs a recipe: collect, train and compare as it says, and hold a figure's results against the paper."""

import math
from collections.abc import Mapping
from types import MappingProxyType

from cluster.candidates.plan import plan_candidates
from cluster.candidates.simulate import simulate
from cluster.comparison.compare import Comparison, compare
from cluster.comparison.plan import Grid, plan_comparison
from cluster.config import Settings
from cluster.datasets.collect import collect
from cluster.datasets.plan import plan_collection
from cluster.progress import say, timing
from cluster.reproduction.cost import cost_items, lines
from cluster.reproduction.plan import CANDIDATES, CANDIDATES_SEED, WORLDS, Reproduction
from cluster.reproduction.recipe import Panel, Training
from cluster.reproduction.report import Table, publish, table
from cluster.runtime.placement import free_machines
from cluster.runtime.session import Session
from cluster.tracking import Tracker
from cluster.training.launch import placement_of
from cluster.training.train import train
from workers import setups

OWN_NAMES: Mapping[str, str] = MappingProxyType({})
"""Steps are called by what they do, unless another name is given."""


def reproduce(reproduction: Reproduction, settings: Settings, session: Session, tracker: Tracker) -> Table:
    """Do what is missing of a figure; the same call goes on after an interruption.

    Args:
        reproduction: what to do.
        settings: of all steps.
        session: where they run.
        tracker: that records them.

    Returns:
        The claims of the paper beside what was measured.

    Raises:
        UserError: as `collect`, `train` and `compare` do; the cluster is checked for all of them first.
    """
    preflight(reproduction, settings, session)
    say_cost(reproduction, settings, session.cpus)
    found = run_steps(reproduction, settings, session, tracker)
    summaries = {name: comparison.summary for name, comparison in found.items()}
    claims = table(reproduction.recipe, summaries, settings.compare.initial_trials)
    for path in publish(reproduction, claims):
        say(f"wrote {path}")
    for line in claims.lines():
        say(line)
    return claims


def say_cost(reproduction: Reproduction, settings: Settings, count: int) -> None:
    """Say what is still to do of a figure, and what that costs; starts nothing.

    Args:
        reproduction: what to do.
        settings: of all steps.
        count: cores that do it.
    """
    recipe = reproduction.recipe
    say(f"{recipe.figure}: {recipe.label}, {reproduction.runs} runs of each method, in {reproduction.folder}")
    for line in lines(reproduction, cost_items(reproduction, settings, count), count):
        say(line)


def preflight(reproduction: Reproduction, settings: Settings, session: Session) -> None:
    """Refuse now what a later step would refuse after hours of work.

    Args:
        reproduction: what to do.
        settings: of all steps.
        session: where they run.

    Raises:
        UserError: the cluster has no room for one of them.
    """
    missing = reproduction.missing_episodes()
    if missing:
        shards = math.ceil(missing / settings.collect.episodes_per_shard)
        session.preflight(min(settings.collect.actor_count(session.cpus), shards))
    if not all(map(reproduction.is_trained, reproduction.trains)):
        placement_of(settings.train, free_machines(session))
    session.preflight(settings.compare.slots)


def run_steps(
    reproduction: Reproduction,
    settings: Settings,
    session: Session,
    tracker: Tracker,
    names: Mapping[str, str] = OWN_NAMES,
) -> dict[str, Comparison]:
    """Collect, train and compare what a recipe asks for and is missing.

    Args:
        reproduction: what to do.
        settings: of all steps.
        session: where they run.
        tracker: that records them.
        names: what a person reads of `collect`, `train` and `compare`, where it is not the step's own name.

    Returns:
        The comparison of each panel, by its name.

    Raises:
        UserError: as `collect`, `train` and `compare` do.
    """
    recipe = reproduction.recipe
    if reproduction.missing_episodes():
        with timing(names.get("collect", f"collect {recipe.data}")):
            _collect(reproduction, settings, session, tracker)
    for training in reproduction.trains:
        with timing(names.get("train", f"train {training.name}")):
            _train(reproduction, training, settings, session, tracker)
    for panel in recipe.panels:
        if panel.candidates:
            _simulate(reproduction, panel, settings, session, tracker)
    found = {}
    for panel in recipe.panels:
        with timing(names.get("compare", f"compare {panel.name}")):
            found[panel.name] = _compare(reproduction, panel, settings, session, tracker)
    return found


def _collect(reproduction: Reproduction, settings: Settings, session: Session, tracker: Tracker) -> None:
    plan = plan_collection(
        setup=setups.load(reproduction.recipe.data),
        episodes=reproduction.episodes,
        folder=reproduction.dataset,
        seed=0,
        settings=settings.collect,
    )
    collect(plan, settings.collect, session, tracker)


def _train(
    reproduction: Reproduction, training: Training, settings: Settings, session: Session, tracker: Tracker
) -> None:
    train(
        folder=reproduction.dataset,
        model=reproduction.models[training],
        preset=reproduction.scale.preset,
        seed=training.seed,
        settings=reproduction.training(settings.train, training.latent),
        session=session,
        tracker=tracker,
    )


def _simulate(
    reproduction: Reproduction, panel: Panel, settings: Settings, session: Session, tracker: Tracker
) -> None:
    """Simulate the candidates of a panel; where another one has the same, nothing is left to do."""
    plan = plan_candidates(
        setups=[setups.load(name) for name in panel.candidates],
        count=CANDIDATES,
        episodes=WORLDS,
        gap="wide",
        seed=CANDIDATES_SEED,
        models=reproduction.models_of(panel),
        chosen=None,
        folder=reproduction.candidates(panel),
        settings=settings.collect,
    )
    if not plan.is_whole:
        with timing(f"simulate candidates in {', '.join(panel.candidates)}"):
            simulate(plan, settings.collect, session, tracker)


def _compare(
    reproduction: Reproduction, panel: Panel, settings: Settings, session: Session, tracker: Tracker
) -> Comparison:
    recipe, ours = reproduction.recipe, settings.compare
    if panel.pool:
        ours = ours.model_copy(update={"pool_size": panel.pool})
    plan = plan_comparison(
        setup=setups.load(panel.setup),
        grid=Grid(panel.methods, seed=0, runs=reproduction.runs),
        trials=panel.trials,
        gap=panel.gap,
        models=reproduction.models_of(panel),
        folder=reproduction.comparison(panel),
        settings=ours,
        caption=f"{recipe.figure}, {panel.name}: {panel.title}" if recipe.figure else "",
        candidates=reproduction.candidates(panel) if panel.candidates else None,
    )
    return compare(plan, session, tracker)
