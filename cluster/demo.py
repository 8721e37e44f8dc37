"""`svaedc demo`: the main job, small and real, in one folder."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from cluster.comparison.compare import Comparison, compare
from cluster.comparison.plan import Grid, plan_comparison
from cluster.config import Settings
from cluster.datasets.collect import collect
from cluster.progress import say, timing
from cluster.runtime.placement import free_machines
from cluster.runtime.session import Session
from cluster.tracking import Tracker
from cluster.training.launch import placement_of
from cluster.training.train import MINIMUM_EPISODES, train
from svaedc.analysis.summary import Difference
from workers import setups

SETUP = "franka"
OURS = "svae-dc"
BASELINES = ("random", "screened-random")


@dataclass(frozen=True)
class DemoSize:
    """How much of everything; by default, what two cores do in a few minutes.

    Attributes:
        episodes: collected.
        updates: gradient updates of each stage of training.
        methods: compared.
        runs: of each method.
        trials: suggested in each run, after the random ones.
    """

    episodes: int = 2048
    updates: int = 1200
    methods: tuple[str, ...] = ("random", "screened-random", "se", "svae", OURS)
    runs: int = 6
    trials: int = 10

    def __post_init__(self) -> None:
        """Refuse what one of the stages would refuse later."""
        if self.episodes < MINIMUM_EPISODES:
            raise ValueError(f"episodes must be at least {MINIMUM_EPISODES}, got {self.episodes}")
        if min(self.updates, self.runs, self.trials, len(self.methods)) < 1:
            raise ValueError(f"updates, methods, runs and trials must be at least 1, got {self}")


FULL = DemoSize()


def demo(
    folder: Path, settings: Settings, session: Session, tracker: Tracker, size: DemoSize = FULL
) -> Comparison:
    """Collect, train and compare on the Franka push; rerun it to go on where it was interrupted.

    Raises:
        UserError: a stage cannot run; the cluster is checked for all of them before the first.
    """
    _preflight(settings, size, session)
    say(
        f"The main job at toy size, in {folder}: {size.episodes} simulated episodes instead of 500,000, "
        f"{size.runs} runs of {size.trials} trials instead of 50 of 20. It shows the machine at work, "
        "and proves nothing about the methods."
    )
    with timing("1/3 collect"):
        collect(
            setup=setups.load(SETUP),
            episodes=size.episodes,
            folder=folder / "dataset",
            seed=0,
            settings=settings.collect,
            session=session,
            tracker=tracker,
        )
    with timing("2/3 train"):
        _train(folder, settings, session, tracker, size)
    with timing("3/3 compare"):
        comparison = _compare(folder, settings, session, tracker, size)
    say(conclusion(folder, comparison, f"svaedc ui --set tracking.uri={tracker.uri}"))
    return comparison


def _train(folder: Path, settings: Settings, session: Session, tracker: Tracker, size: DemoSize) -> None:
    usual = {"updates": size.updates, "cache_folder": folder / "cache"}
    given = settings.train.model_fields_set
    train(
        folder=folder / "dataset",
        model=folder / "model",
        preset="compact",
        seed=0,
        settings=settings.train.model_copy(
            update={name: value for name, value in usual.items() if name not in given}
        ),
        session=session,
        tracker=tracker,
    )


def _compare(
    folder: Path, settings: Settings, session: Session, tracker: Tracker, size: DemoSize
) -> Comparison:
    plan = plan_comparison(
        setup=setups.load(SETUP),
        grid=Grid(size.methods, seed=0, runs=size.runs),
        trials=size.trials,
        gap="paper",
        model=folder / "model",
        folder=folder / "comparison",
        settings=settings.compare,
    )
    return compare(plan, session, tracker)


def _preflight(settings: Settings, size: DemoSize, session: Session) -> None:
    """Refuse now what a later stage would refuse after minutes of work."""
    shards = math.ceil(size.episodes / settings.collect.episodes_per_shard)
    session.preflight(min(settings.collect.actor_count(session.cpus), shards))
    placement_of(settings.train, free_machines(session))
    session.preflight(settings.compare.slots)


def conclusion(folder: Path, comparison: Comparison, viewer: str) -> str:
    """What the numbers show, and where everything is.

    Args:
        folder: of the demo.
        comparison: its last stage.
        viewer: the command that serves the comparison's MLflow run.
    """
    found = [
        verdict(difference)
        for difference in comparison.summary.differences
        if difference.method == OURS and difference.baseline in BASELINES
    ]
    collapsed = json.loads((folder / "model" / "metrics.json").read_text())["collapsed"]
    if collapsed:
        found.append(f"Note, at this size: {collapsed}")
    places = {
        "figure": folder / "comparison" / "figure.png",
        "all trials": folder / "comparison" / "trials.parquet",
        "dataset": folder / "dataset",
        "model": folder / "model" / "model.pt",
        "its picture": folder / "model" / "reconstruction.png",
        "MLflow run": f"{comparison.url} (served by: {viewer})",
    }
    return "\n".join([*found, *(f"  {name:<11} {place}" for name, place in places.items())])


def verdict(difference: Difference) -> str:
    """One sentence on the difference of two methods at the end, and on whether these runs can tell."""
    end, pair = difference.best[-1], f"{difference.method} against {difference.baseline}"
    if not difference.runs:
        return f"{pair}: no run in common."
    if math.isnan(end.low):
        return f"{pair}: {end.mean:+.2f} at the end, in one run, which tells nothing about the next."
    telling = (
        "it includes zero: so few runs cannot tell the two apart"
        if end.low <= 0 <= end.high
        else "it excludes zero in these runs, on this one task and model"
    )
    return (
        f"{pair}: best objective {end.mean:+.2f} on average over {difference.runs} paired runs, "
        f"90 % bootstrap interval [{end.low:+.2f}, {end.high:+.2f}]; {telling}."
    )
