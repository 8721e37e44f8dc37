"""`svaedc demo`: the main job, small and real, in one folder."""

from pathlib import Path

from cluster.collect import collect
from cluster.compare import Grid, compare
from cluster.config import Settings
from cluster.progress import say, timed
from cluster.session import Session
from cluster.tracking import Tracker
from cluster.train import train
from svaedc.statistics import Summary
from workers import setups

SETUP = "franka"
EPISODES = 2048
UPDATES = 1200
METHODS = ("random", "screened-random", "se", "svae", "svae-dc")
RUNS = 6
TRIALS = 10


def demo(folder: Path, settings: Settings, session: Session, tracker: Tracker) -> None:
    """Collect, train and compare on the Franka push; rerun it to go on where it was interrupted."""
    setup = setups.load(SETUP)
    dataset, model, out = folder / "dataset", folder / "model", folder / "comparison"
    say(
        f"The main job at toy size, in {folder}: {EPISODES} simulated episodes instead of 500,000, "
        f"{RUNS} runs of {TRIALS} trials instead of 50 of 20. It shows the machine at work, "
        "and proves nothing about the methods."
    )
    with timed("1/3 collect"):
        collect(
            setup=setup,
            episodes=EPISODES,
            folder=dataset,
            seed=0,
            settings=settings.collect,
            session=session,
            tracker=tracker,
        )
    with timed("2/3 train"):
        train(
            folder=dataset,
            model=model,
            preset="compact",
            seed=0,
            settings=settings.train.model_copy(update={"updates": UPDATES, "cache_folder": folder / "cache"}),
            session=session,
            tracker=tracker,
        )
    with timed("3/3 compare"):
        summary = compare(
            setup=setup,
            grid=Grid(METHODS, seed=0, runs=RUNS),
            trials=TRIALS,
            gap="paper",
            model=model,
            folder=out,
            settings=settings.compare,
            session=session,
            tracker=tracker,
        )
    _conclude(summary, folder, tracker)


def _conclude(summary: Summary, folder: Path, tracker: Tracker) -> None:
    """Say where everything is, and what the numbers show: with so few runs, mostly wide intervals."""
    ranked = sorted(summary.methods.items(), key=lambda pair: -pair[1].best[-1].mean)
    (first, best), (second, next_best) = ranked[:2]
    gap = best.best[-1].mean - next_best.best[-1].mean
    apart = best.best[-1].low > next_best.best[-1].high
    verdict = (
        "their intervals do not overlap" if apart else "their intervals overlap: this many runs cannot tell"
    )
    say(
        f"{first} ended highest, {gap:.2f} above {second}; {verdict}.\n"
        f"  figure      {folder / 'comparison' / 'figure.png'}\n"
        f"  all trials  {folder / 'comparison' / 'trials.parquet'}\n"
        f"  dataset     {folder / 'dataset'}\n"
        f"  model       {folder / 'model' / 'model.pt'}\n"
        f"  its picture {folder / 'model' / 'reconstruction.png'}\n"
        f"  MLflow      {tracker.page} (start it with: svaedc ui --set tracking.uri={tracker.uri})"
    )
