"""`svaedc collect`: simulated episodes into a dataset."""

from typing import Annotated

import typer

from cluster.cli.options import (
    Address,
    Config,
    DatasetFolder,
    Overrides,
    Seed,
    SetupName,
    services,
    settings_of,
)
from cluster.inputs import require_working_setup, setup_of


def collect(
    setup: SetupName,
    dataset: DatasetFolder,
    episodes: Annotated[int, typer.Option("--episodes", min=1, help="How many the dataset shall hold.")],
    repeats: Annotated[
        int, typer.Option("--repeats", min=1, help="Episodes of each controller, each under other physics.")
    ] = 1,
    gap: Annotated[
        str,
        typer.Option(
            "--gap",
            metavar="LEVEL",
            help="Physics of another level than data collection's: paper, training, wide, or "
            "NAME=LOW:HIGH,NAME=VALUE.",
        ),
    ] = "",
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
    settings, chosen = settings_of(config, overrides), require_working_setup(setup_of(setup, bad), seed)
    from cluster.datasets.plan import plan_collection, say_complete

    missing = plan_collection(
        setup=chosen,
        episodes=episodes,
        folder=dataset,
        seed=seed,
        repeats=repeats,
        gap=gap,
        settings=settings.collect,
    )
    if not missing.missing and not plan:
        say_complete(missing)
        return
    from cluster.datasets.collect import collect as run_collect
    from cluster.datasets.collect import collect_pilot

    with services(settings, address, parts=()) as (session, tracker):
        (collect_pilot if plan else run_collect)(missing, settings.collect, session, tracker)
