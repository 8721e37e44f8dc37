"""`svaedc collect` and `svaedc candidates`: simulated episodes, of random controllers and of candidates."""

from pathlib import Path
from typing import Annotated, Any

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
from cluster.errors import UsageError
from cluster.inputs import durable, durable_dataset, durable_each, require_working_setup, setup_of

Also = Annotated[
    str,
    typer.Option(
        "--also",
        metavar="SETUPS",
        help="Further setups with the same controllers, separated by commas, such as the robot in another "
        "engine.",
    ),
]
Encoders = Annotated[
    list[Path] | None,
    typer.Option(
        "--model",
        help="Folder of a trained model, which encodes every episode; may be repeated.",
        callback=durable_each,
    ),
]
Among = Annotated[
    Any,  # a Location, which typer does not know
    typer.Option(
        "--among",
        metavar="PLACE",
        help="A dataset: half of the candidates are chosen among its controllers; the others are drawn.",
        parser=durable_dataset,
    ),
]


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


def candidates(
    setup: SetupName,
    out: Annotated[Path, typer.Option("--out", help="Folder of the candidates.", callback=durable)],
    model: Encoders = None,
    count: Annotated[int, typer.Option("--count", min=2, help="How many candidates.")] = 2000,
    episodes: Annotated[
        int,
        typer.Option("--episodes", min=1, help="Of each candidate in each setup, under different physics."),
    ] = 6,
    gap: Annotated[
        str, typer.Option("--gap", help="Physics: paper, training, wide, or NAME=LOW:HIGH,NAME=VALUE.")
    ] = "wide",
    also: Also = "",
    among: Among = None,
    keep: Annotated[
        str, typer.Option("--keep", help="Which controllers of --among: best or least-bad.")
    ] = "best",
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="Decides every random draw; not that of the model's dataset.")
    ] = 1,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
) -> None:
    """Simulate candidates under several physics each, before any of them is tried on a robot.

    Writes candidates.parquet: of every candidate the controller, and of every episode the objective, the
    badness, the bad conditions and, with --model, the latent path, with their means and spreads. `compare
    --candidates` and `hardware start --candidates` choose among them. All candidates share their physics. Run
    the same command again after an interruption.
    """
    from cluster.candidates.plan import choose, plan_candidates
    from workers.collection.choice import Keep

    settings = settings_of(config, overrides)
    names = [name.strip() for name in also.split(",") if name.strip()]
    found = [require_working_setup(setup_of(name), seed) for name in dict.fromkeys([setup, *names])]
    if keep not in list(Keep):
        raise UsageError(f"--keep must be one of {', '.join(Keep)}, got {keep!r}")
    chosen = choose(among, found[0], Keep(keep), count // 2) if among is not None else None
    plan = plan_candidates(
        setups=found,
        count=count,
        episodes=episodes,
        gap=gap,
        seed=seed,
        models=model or [],
        chosen=chosen,
        folder=out,
        settings=settings.collect,
    )
    from cluster.candidates.simulate import say_whole, simulate, summarise

    if plan.is_whole:
        say_whole(plan)
        return
    if not any(collection.missing for collection in plan.collections):
        summarise(plan)
        return
    with services(settings, address, parts=()) as (session, tracker):
        simulate(plan, settings.collect, session, tracker)
