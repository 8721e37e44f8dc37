"""`svaedc reproduce`: collect, train and compare as a recipe says, then hold results against the paper."""

from cluster.comparison.compare import compare
from cluster.comparison.plan import Grid, plan_comparison
from cluster.config import Settings
from cluster.datasets.collect import collect
from cluster.progress import say, timing
from cluster.reproduction.cost import bill, lines
from cluster.reproduction.experiment import Panel
from cluster.reproduction.plan import Reproduction
from cluster.reproduction.report import Table, publish, table
from cluster.runtime.placement import free_machines
from cluster.runtime.session import Session
from cluster.tracking import Tracker
from cluster.training.launch import placement_of
from cluster.training.train import train
from svaedc.analysis.summary import Summary
from workers import setups


def reproduce(reproduction: Reproduction, settings: Settings, session: Session, tracker: Tracker) -> Table:
    """Do what is missing of a reproduction; the same call goes on after an interruption.

    Raises:
        UserError: as `collect`, `train` and `compare` do; the cluster is checked for all of them first.
    """
    _preflight(reproduction, settings, session)
    foretell(reproduction, settings, session.cpus)
    _collect(reproduction, settings, session, tracker)
    for latent in reproduction.trains:
        _train(reproduction, latent, settings, session, tracker)
    summaries = {
        panel.name: _compare(reproduction, panel, settings, session, tracker)
        for panel in reproduction.recipe.panels
    }
    found = table(reproduction.recipe, summaries, settings.compare.initial_trials)
    for path in publish(reproduction, found):
        say(f"wrote {path}")
    for line in found.lines():
        say(line)
    return found


def foretell(reproduction: Reproduction, settings: Settings, count: int) -> None:
    """Say what is still to do of a reproduction, and what that costs on so many cores; starts nothing."""
    recipe = reproduction.recipe
    say(f"{recipe.figure}: {recipe.label}, {reproduction.runs} runs of each method, in {reproduction.folder}")
    for line in lines(reproduction, bill(reproduction, settings, count), count):
        say(line)


def _preflight(reproduction: Reproduction, settings: Settings, session: Session) -> None:
    """Refuse now what a later step would refuse after hours of work."""
    session.preflight(settings.compare.slots)
    if reproduction.collects:
        session.preflight(settings.collect.actor_count(session.cpus))
    if not all(map(reproduction.is_trained, reproduction.trains)):
        placement_of(settings.train, free_machines(session))


def _collect(reproduction: Reproduction, settings: Settings, session: Session, tracker: Tracker) -> None:
    if not reproduction.missing_episodes():
        return
    with timing(f"collect {reproduction.recipe.data}"):
        collect(
            setup=setups.load(reproduction.recipe.data),
            episodes=reproduction.episodes,
            folder=reproduction.dataset,
            seed=0,
            settings=settings.collect,
            session=session,
            tracker=tracker,
        )


def _train(
    reproduction: Reproduction, latent: str, settings: Settings, session: Session, tracker: Tracker
) -> None:
    with timing(f"train {latent}"):
        train(
            folder=reproduction.dataset,
            model=reproduction.models[latent],
            preset=reproduction.scale.preset,
            seed=0,
            settings=reproduction.training(settings.train, latent),
            session=session,
            tracker=tracker,
        )


def _compare(
    reproduction: Reproduction, panel: Panel, settings: Settings, session: Session, tracker: Tracker
) -> Summary:
    with timing(f"compare {panel.name}"):
        plan = plan_comparison(
            setup=setups.load(panel.setup),
            grid=Grid(panel.methods, seed=0, runs=reproduction.runs),
            trials=panel.trials,
            gap=panel.gap,
            model=reproduction.models[panel.latent] if panel.latent else None,
            folder=reproduction.comparison(panel),
            settings=settings.compare,
            caption=f"{reproduction.recipe.figure}, {panel.name}: {panel.title}",
        )
        return compare(plan, session, tracker).summary
