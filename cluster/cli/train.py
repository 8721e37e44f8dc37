"""`svaedc train`: a model of a dataset."""

from typing import Annotated

import typer

from cluster.cli.options import (
    Address,
    Config,
    DatasetFolder,
    ModelFolder,
    Overrides,
    Seed,
    services,
    settings_of,
)


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
