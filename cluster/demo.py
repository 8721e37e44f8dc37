"""`svaedc demo`: the main job, small and real, in one folder."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

from cluster.comparison.compare import Comparison
from cluster.config import Settings
from cluster.progress import say
from cluster.reproduction.plan import Reproduction, Scale
from cluster.reproduction.recipe import NINE, Panel, Recipe, Training
from cluster.reproduction.run import preflight, run_steps
from cluster.runtime.session import Session
from cluster.tracking import Tracker
from cluster.training.train import MINIMUM_EPISODES
from svaedc.analysis.summary import Difference

SETUP = "franka"
OURS = "svae-dc"
BASELINES = ("random", "screened-random")
STEPS = {"collect": "1/3 collect", "train": "2/3 train", "compare": "3/3 compare"}
"""A person reads these names of the steps of the demo."""


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
    updates: int = 500
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

    Args:
        folder: of everything.
        settings: of all stages; training is short and its cache lies in the folder unless they ask for
            others.
        session: where they run.
        tracker: that records them.
        size: how much of everything.

    Returns:
        The comparison at the end, with its MLflow run.

    Raises:
        UserError: a stage cannot run; the cluster is checked for all of them before the first.
    """
    reproduction, settings = plan_demo(folder, size), _demo_settings(folder, settings, size)
    preflight(reproduction, settings, session)
    say(
        f"The main job at toy size, in {folder}: {size.episodes} simulated episodes instead of 500,000, "
        f"{size.runs} runs of {size.trials} trials instead of 50 of 20. It shows the machine at work, "
        "and proves nothing about the methods."
    )
    [comparison] = run_steps(reproduction, settings, session, tracker, STEPS).values()
    say(conclusion(folder, comparison, tracker.viewer))
    return comparison


def plan_demo(folder: Path, size: DemoSize = FULL) -> Reproduction:
    """The demo as a recipe: one comparison on the Franka push, with the data and the model that it needs.

    Args:
        folder: of everything.
        size: how much of it.

    Returns:
        What `run_steps` does.
    """
    panel = Panel("comparison", "", SETUP, size.methods, size.trials)
    return Reproduction(
        recipe=Recipe("", "The main job at toy size", SETUP, size.runs, (panel,), ()),
        scale=Scale("compact", {SETUP: size.episodes}),
        folder=folder,
        episodes=size.episodes,
        runs=size.runs,
        dataset=folder / "dataset",
        collects=True,
        models={Training(NINE): folder / "model"},
        trains=(Training(NINE),),
        results=folder,
    )


def _demo_settings(folder: Path, settings: Settings, size: DemoSize) -> Settings:
    """A short training and a cache of its own, unless the user asked for others."""
    usual = {"updates": size.updates, "cache_folder": folder / "cache"}
    given = settings.train.model_fields_set
    changed = {name: value for name, value in usual.items() if name not in given}
    return settings.model_copy(update={"train": settings.train.model_copy(update=changed)})


def conclusion(folder: Path, comparison: Comparison, viewer: str) -> str:
    """Put into words what the numbers show, and where everything is.

    Args:
        folder: of the demo.
        comparison: its last stage.
        viewer: the command that serves the comparison's MLflow run; "" where a server does already.

    Returns:
        Text of several lines.
    """
    found = [
        verdict(difference)
        for difference in comparison.summary.differences
        if difference.method == OURS and difference.baseline in BASELINES
    ]
    collapsed = json.loads((folder / "model" / "metrics.json").read_text(encoding="utf-8"))["collapsed"]
    if collapsed:
        found.append(f"Note, at this size: {collapsed}")
    places = {
        "figure": folder / "comparison" / "figure.png",
        "all trials": folder / "comparison" / "trials.parquet",
        "dataset": folder / "dataset",
        "model": folder / "model" / "model.pt",
        "its picture": folder / "model" / "reconstruction.png",
        "MLflow run": f"{comparison.url}{viewer and f' (served by: {viewer})'}",
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
