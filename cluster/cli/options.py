"""Options that several commands share."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cluster.inputs import durable, durable_dataset, durable_each
from workers.setups.names import SETUPS

if TYPE_CHECKING:
    from cluster.config import Part, Settings
    from cluster.runtime.session import Session
    from cluster.tracking import Tracker


Config = Annotated[
    Path | None,
    typer.Option(
        "--config",
        help="Settings file; without it, ray_config.yaml in the working directory if there is one.",
    ),
]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="SECTION.KEY=VALUE", help="Any setting, over the file; may be repeated."),
]
Address = Annotated[
    str | None,
    typer.Option(
        "--address",
        metavar="HOST:PORT",
        help="A running Ray cluster that this machine belongs to, or auto; without it that of RAY_ADDRESS, "
        "and without that one is started here for this command.",
    ),
]
Seed = Annotated[int, typer.Option("--seed", min=0, help="Decides every random draw.")]
SetupName = Annotated[
    str,
    typer.Option(
        "--setup",
        help=f"{', '.join(SETUPS)}; one of an installed package (see `svaedc setups`); or your own, as "
        "MODULE or MODULE:NAME.",
    ),
]
DatasetFolder = Annotated[
    Any,  # a Location, which typer does not know
    typer.Option(
        "--dataset", metavar="PLACE", help="Its folder, or s3://bucket/prefix.", parser=durable_dataset
    ),
]
ModelFolder = Annotated[Path, typer.Option("--model", help="Folder of the model.", callback=durable)]
TrainedModel = Annotated[
    Path | None, typer.Option("--model", help="Folder of a trained model.", callback=durable)
]
TrainedModels = Annotated[
    list[Path] | None,
    typer.Option(
        "--model",
        help="Folder of a trained model; may be repeated, and then runs take turns with the models.",
        callback=durable_each,
    ),
]
SimulatedCandidates = Annotated[
    Path | None,
    typer.Option(
        "--candidates",
        help="Folder of candidates that `svaedc candidates` simulated, to choose among.",
        callback=durable,
    ),
]


def settings_of(config: Path | None, overrides: list[str] | None) -> "Settings":
    """Read the settings of a command.

    Args:
        config: the file given with `--config`; None for the usual one, if it exists.
        overrides: the texts of `--set`; None for none.

    Returns:
        All sections.
    """
    from cluster.settings import load_settings

    return load_settings(config, overrides or [])


@contextmanager
def services(
    settings: "Settings", address: str | None, parts: "tuple[Part, ...]" = ("dashboard",)
) -> Iterator[tuple["Session", "Tracker"]]:
    """The services of a command that may be interrupted; see `cluster.services`.

    Args:
        settings: of the command.
        address: of a running cluster; None to start one here.
        parts: of a cluster that is started here.

    Yields:
        The connection to Ray, and the tracker.
    """
    from cluster.runtime.signals import interruptible
    from cluster.services import services as opened

    with interruptible(), opened(settings, address, parts) as both:
        yield both
