"""The command line `svaedc`: the same on a laptop, against a cluster, and under `ray job submit`."""

import json
import sys
from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.options import (
    Address,
    Config,
    DatasetFolder,
    ModelFolder,
    Overrides,
    Seed,
    SetupName,
    TrainedModel,
    services,
    settings_of,
)
from cluster.errors import UserError
from cluster.inputs import durable, setup_of, working
from cluster.progress import say

app = typer.Typer(
    name="svaedc",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Learn robot controllers in ten trials: simulate many, learn a latent space of their trajectories "
    "that is compressed where they behave badly, and run Bayesian optimisation there.\n\n"
    "A first look: `svaedc demo`. The steps on their own: `collect`, `train`, `compare`, `hardware`; "
    "`render` shows an episode, `reproduce` makes a figure of the paper. "
    "Every long command may be interrupted and started again: it goes on where it was.",
)


@app.command()
def demo(
    folder: Annotated[Path, typer.Option("--folder", help="Where everything goes.", callback=durable)] = Path(
        "svaedc-demo"
    ),
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
) -> None:
    """The main job, small and real: collect, train and compare on the Franka push, in a few minutes."""
    from cluster.demo import demo as run_demo

    folder.mkdir(parents=True, exist_ok=True)
    # Quoted, because a folder's name may mean something in YAML.
    store = json.dumps(f"sqlite:///{folder / 'mlflow.db'}")
    settings = settings_of(config, [f"tracking.uri={store}", *(overrides or [])])
    with services(settings, address) as (session, tracker):
        run_demo(folder, settings, session, tracker)


@app.command()
def collect(
    setup: SetupName,
    dataset: DatasetFolder,
    episodes: Annotated[int, typer.Option("--episodes", min=1, help="How many the dataset shall hold.")],
    repeats: Annotated[
        int, typer.Option("--repeats", min=1, help="Episodes of each controller, each under other physics.")
    ] = 1,
    bad: Annotated[
        str,
        typer.Option("--bad", metavar="MODULE:FUNCTION", help="G_bad of your own instead of the setup's."),
    ] = "",
    seed: Seed = 0,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
    *,
    plan: Annotated[
        bool, typer.Option("--plan", help="Collect a few shards, and say what all of it will cost.")
    ] = False,
) -> None:
    """Roll out random controllers on a pool of Ray actors into Parquet shards.

    What the folder holds already is kept: run the same command again after an interruption, or ask for more
    episodes to extend the dataset. With --plan, only the first shards are collected, and what all of them
    will cost is told from those.
    """
    from cluster.datasets.collect import collect as run_collect
    from cluster.datasets.collect import foretell

    settings, chosen = settings_of(config, overrides), working(setup_of(setup, bad), seed)
    with services(settings, address, parts=()) as (session, tracker):
        (foretell if plan else run_collect)(
            setup=chosen,
            episodes=episodes,
            folder=dataset,
            seed=seed,
            repeats=repeats,
            settings=settings.collect,
            session=session,
            tracker=tracker,
        )


@app.command()
def train(
    dataset: DatasetFolder,
    model: ModelFolder,
    preset: Annotated[
        str, typer.Option("--preset", help="compact (two CPU cores, minutes) or paper (a GPU, hours).")
    ] = "compact",
    sweep: Annotated[  # noqa: FBT002 - a switch of the command line
        bool, typer.Option("--sweep", help="Try choices around the preset, and say which is best for BO.")
    ] = False,
    seed: Seed = 0,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
) -> None:
    """Fit the SVAE-DC to a dataset with Ray Train; the same command goes on after an interruption.

    With --sweep, several models around the preset are trained on Ray Tune, one CPU each, and ranked by a
    cheap proxy of what they are worth for Bayesian optimisation.
    """
    from cluster.training.sweep import sweep as run_sweep
    from cluster.training.train import train as run_train

    settings = settings_of(config, overrides)
    with services(settings, address) as (session, tracker):
        (run_sweep if sweep else run_train)(
            folder=dataset,
            model=model,
            preset=preset,
            seed=seed,
            settings=settings.train,
            session=session,
            tracker=tracker,
        )


@app.command()
def compare(
    setup: SetupName,
    out: Annotated[Path, typer.Option("--out", help="Folder of the results.", callback=durable)],
    methods: Annotated[
        str, typer.Option("--methods", help="Names, separated by commas; see docs/methods.md.")
    ] = ("random,screened-random,se,svae,svae-dc"),
    runs: Annotated[int, typer.Option("--runs", min=1, help="Seeds of each method.")] = 50,
    trials: Annotated[
        int, typer.Option("--trials", min=1, help="Suggested trials, after the random ones.")
    ] = 20,
    gap: Annotated[
        str, typer.Option("--gap", help="Hidden physics: paper, training, wide, or NAME=LOW:HIGH,NAME=VALUE.")
    ] = "paper",
    model: TrainedModel = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the first run; run i has seed + i.")] = 0,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
) -> None:
    """Run methods of Bayesian optimisation side by side in simulation, in parallel on Ray Tune.

    All methods of a seed share their random trials and the hidden physics. Report seeds below 1000; tune with
    --seed 1000 and above. Writes trials.parquet, summary.json, report.html, figure.png and figure.svg.
    """
    from cluster.comparison.compare import compare as run_comparison
    from cluster.comparison.plan import Grid, plan_comparison

    settings = settings_of(config, overrides)
    names = tuple(dict.fromkeys(name.strip() for name in methods.split(",") if name.strip()))
    plan = plan_comparison(
        setup=setup_of(setup),
        grid=Grid(names, seed, runs),
        trials=trials,
        gap=gap,
        model=model,
        folder=out,
        settings=settings.compare,
    )
    with services(settings, address) as (session, tracker):
        run_comparison(plan, session, tracker)


@app.command()
def ui(
    port: Annotated[int, typer.Option("--port", min=1, max=65535, help="On 127.0.0.1.")] = 5000,
    config: Config = None,
    overrides: Overrides = None,
) -> None:
    """Show every run in a browser: serves MLflow on this machine only."""
    from cluster.tracking.server import serve_ui

    serve_ui(settings_of(config, overrides).tracking, port, lambda url: say(f"open {url}  (Ctrl-C ends it)"))


def _add_groups() -> None:
    from cluster.cli.dataset import app as dataset_app
    from cluster.cli.hardware import app as hardware_app
    from cluster.cli.render import render
    from cluster.cli.reproduce import reproduce

    app.command()(render)
    app.command()(reproduce)
    app.add_typer(dataset_app, name="dataset")
    app.add_typer(hardware_app, name="hardware")


_add_groups()


def main() -> None:
    """Run a command; a user's mistake becomes one line and an exit code, never a traceback."""
    try:
        app()
    except UserError as error:
        say(f"error: {error}")
        sys.exit(error.exit_code)
    except OSError as error:
        say(f"error: {error.strerror or error}{f': {error.filename}' if error.filename else ''}")
        sys.exit(UserError.exit_code)
