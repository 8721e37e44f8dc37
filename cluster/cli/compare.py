"""`svaedc compare`: methods of Bayesian optimisation side by side."""

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Annotated, Any

import typer

from cluster.cli.documents import one_document
from cluster.cli.options import (
    Address,
    Config,
    Overrides,
    SetupName,
    SimulatedCandidates,
    TrainedModels,
    services,
    settings_of,
)
from cluster.inputs import durable, setup_of

Report = Annotated[
    bool,
    typer.Option(
        "--report",
        help="Run nothing: report the trials that the folder holds, also those of an interrupted comparison, "
        "and say which runs are missing.",
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        help="Print one JSON document, and nothing else, on standard output: what summary.json holds (title, "
        "setup, gap, initial_trials, verdict, pairs, missing, trials, purpose, confidence, methods by name, "
        "differences), with folder and mlflow_run (null with --report). What has no number is null.",
    ),
]


def compare(
    setup: SetupName,
    out: Annotated[Path, typer.Option("--out", help="Folder of the results.", callback=durable)],
    methods: Annotated[
        str,
        typer.Option(
            "--methods", help="Names, separated by commas (see `svaedc methods`); your own as MODULE:NAME."
        ),
    ] = ("random,screened-random,se,svae,svae-dc"),
    runs: Annotated[int, typer.Option("--runs", min=1, help="Seeds of each method.")] = 50,
    trials: Annotated[
        int, typer.Option("--trials", min=1, help="Suggested trials, after the random ones.")
    ] = 20,
    gap: Annotated[
        str, typer.Option("--gap", help="Hidden physics: paper, training, wide, or NAME=LOW:HIGH,NAME=VALUE.")
    ] = "paper",
    model: TrainedModels = None,
    candidates: SimulatedCandidates = None,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Of the first run; run i has seed + i.")] = 0,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
    *,
    report: Report = False,
    as_json: AsJson = False,
) -> None:
    """Run methods of Bayesian optimisation side by side in simulation, in parallel on Ray Tune.

    All methods of a seed share their random trials and the hidden physics. Report seeds below 1000; tune with
    --seed 1000 and above. Writes trials.parquet, summary.json, report.html, figure.png and figure.svg.
    """
    from cluster.comparison.interim import describe
    from cluster.comparison.interim import report as report_interim
    from cluster.comparison.plan import Grid, plan_comparison

    settings = settings_of(config, overrides)
    names = tuple(dict.fromkeys(name.strip() for name in methods.split(",") if name.strip()))
    output: AbstractContextManager[dict[str, Any]] = one_document() if as_json else nullcontext({})
    with output as document:
        plan = plan_comparison(
            setup=setup_of(setup),
            grid=Grid(names, seed, runs),
            trials=trials,
            gap=gap,
            models=model or [],
            candidates=candidates,
            folder=out,
            settings=settings.compare,
        )
        if report:
            document |= {**describe(plan, report_interim(plan)), "mlflow_run": None}
            return
        from cluster.comparison.compare import compare as run_comparison

        with services(settings, address) as (session, tracker):
            found = run_comparison(plan, session, tracker)
        document |= {**describe(plan, found.summary), "mlflow_run": found.url}
