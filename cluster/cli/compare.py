"""`svaedc compare`: methods of Bayesian optimisation side by side."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.options import Address, Config, Overrides, SetupName, TrainedModel, services, settings_of
from cluster.inputs import durable, setup_of


def compare(
    setup: SetupName,
    out: Annotated[Path, typer.Option("--out", help="Folder of the results.", callback=durable)],
    methods: Annotated[
        str, typer.Option("--methods", help="Names, separated by commas; see docs/reference/methods.md.")
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
