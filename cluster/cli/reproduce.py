"""`svaedc reproduce`: a figure of the paper, from data to picture."""

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cluster.cli.options import Address, Config, Overrides, services, settings_of
from cluster.errors import UsageError
from cluster.home import expand_home
from cluster.inputs import durable, durable_dataset, usage_errors

if TYPE_CHECKING:
    from collections.abc import Sequence

    from cluster.config import Settings
    from cluster.reproduction.plan import Reproduction
    from workers.dataset.storage.location import Location

_SCALE_HELP = (
    "machine: what two cores collect in up to an hour; paper: 500,000 episodes and its own training."
)


Figure = Annotated[str, typer.Argument(help="figure-4, 5, 7, 8, 9 or 13; figure-5-mujoco, 8, 9; transfer.")]
Folder = Annotated[
    Path, typer.Option("--folder", help="Of data, models and results; shared by figures.", callback=durable)
]
ScaleName = Annotated[str, typer.Option("--scale", help=_SCALE_HELP)]
Episodes = Annotated[
    int | None, typer.Option("--episodes", min=200, help="To collect, instead of the scale's.")
]
Runs = Annotated[
    int | None, typer.Option("--runs", min=1, max=1000, help="Of each method, instead of the paper's.")
]
Given = Annotated[
    Any,  # a Location, which typer does not know
    typer.Option(
        "--dataset", metavar="PLACE", help="Collected already; used as it is.", parser=durable_dataset
    ),
]
Models = Annotated[
    list[Path] | None,
    typer.Option("--model", help="Trained already; may be repeated, one of each latent size."),
]
Plan = Annotated[bool, typer.Option("--plan", help="Only say what it will cost.")]


def reproduce(
    figure: Figure,
    folder: Folder = Path("reproduction"),
    scale: ScaleName = "machine",
    episodes: Episodes = None,
    runs: Runs = None,
    dataset: Given = None,
    model: Models = None,
    config: Config = None,
    overrides: Overrides = None,
    address: Address = None,
    *,
    plan: Plan = False,
) -> None:
    """Make a figure of the paper: collect, train, compare, and hold the numbers against what it claims.

    It says first what that costs. It may be interrupted: the same command goes on, and keeps what is done.
    Figures 4 and 7 need robots: here simulated stand-ins take their place, and are called so everywhere.

    figure-5-mujoco, figure-8-mujoco and figure-9-mujoco ask the same of robots in another engine, MuJoCo,
    with the model of figures 5, 8 and 9 (its left panel): what carries over to a robot that is not the
    simulation?

    transfer is the study of ten trials: three robots (transfer-franka, transfer-yumi, transfer-daisy), each
    hidden in three ways, with learnt features and with candidates that were simulated, and two trainings.

    Both Yumi figures from one dataset and model, in the same folder: `svaedc reproduce figure-8`, then
    `svaedc reproduce figure-7 --runs 50`
    """
    from cluster.reproduction import paper_figures
    from cluster.reproduction import plan as scales
    from cluster.reproduction.plan import resolve
    from cluster.reproduction.run import reproduce as run_reproduction

    settings = settings_of(config, overrides)
    _require_consistent(settings, dataset, episodes)
    with usage_errors():
        recipes, size = paper_figures.recipes(figure), scales.scale(scale)
        models = tuple(expand_home(path).absolute() for path in model or ())
    if len(recipes) > 1 and (models or dataset is not None):
        raise UsageError(
            f"{figure} is of several robots, and --dataset and --model of one: name one of "
            f"{', '.join(recipe.figure for recipe in recipes)}"
        )
    reproductions = [
        resolve(
            recipe,
            size,
            folder,
            episodes=episodes or size.episodes.get(recipe.data, 0),
            runs=runs or recipe.runs,
            dataset=dataset,
            models=models,
        )
        for recipe in recipes
    ]
    if plan:
        _say_cost(reproductions, settings, address)
        return
    with services(settings, address) as (session, tracker):
        for reproduction in reproductions:
            run_reproduction(reproduction, settings, session, tracker)


def _say_cost(reproductions: "Sequence[Reproduction]", settings: "Settings", address: str | None) -> None:
    """Starts nothing; a cluster that runs is asked for its CPUs."""
    from cluster.reproduction.plan import cores
    from cluster.reproduction.run import say_cost
    from cluster.runtime.session import connect

    with connect(settings.ray, address) if address else nullcontext() as session:
        count = session.cpus if session else cores(settings)
        for reproduction in reproductions:
            say_cost(reproduction, settings, count)


def _require_consistent(settings: "Settings", dataset: "Location | None", episodes: int | None) -> None:
    if settings.train.latent != "preset":
        raise UsageError("a figure's panels decide the size of the latent path: leave train.latent out")
    if dataset is not None and episodes is not None:
        raise UsageError("--episodes says how many to collect, --dataset is collected already: leave one out")
