"""Options that several commands share."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlsplit

import typer

from cluster.config import Settings
from cluster.errors import UsageError, UserError
from cluster.progress import say
from cluster.settings_file import load_settings
from workers import setups
from workers.dataset.location import Location, location
from workers.setups import Setup
from workers.tasks.own_bad import with_bad

INTERRUPTED = 130
"""Exit code after Ctrl-C."""
KEPT = "everything finished is kept, and the same command goes on from here"
"""What stopping means for nearly all commands."""


def durable(path: Path | None) -> Path | None:
    """An absolute path that outlives the command.

    Raises:
        UsageError: the path is relative inside a submitted job, where it would lie in a temporary copy of the
            working directory that Ray deletes.
    """
    if path is None:
        return None
    if not path.is_absolute() and "working_dir_files" in Path.cwd().parts:
        raise UsageError(
            f"{path} would be deleted with the job's copy of the working directory; "
            "give an absolute path that every machine of the cluster sees, or, for a campaign on hardware, "
            "one on a local disk of the robot's machine"
        )
    return path.expanduser().absolute()


def dataset_location(text: str) -> Location:
    """Where a dataset lies: a folder, or `s3://bucket/prefix`.

    What the environment says of the store becomes part of its address, so that every process goes to the same
    one, wherever it runs. Credentials never do.

    Raises:
        UsageError: it has a scheme, but is no address of an object store.
    """
    try:
        place = location(text)
    except ValueError as error:
        raise UsageError(str(error)) from error
    return place.expanduser() if isinstance(place, Path) else place.at(_store_of_environment())


def _store_of_environment() -> dict[str, str]:
    """The options of an address that the standard variables of AWS give, those that are set."""
    endpoint = os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL", "")
    parts = urlsplit(endpoint)
    options = {
        "endpoint_override": parts.netloc,
        "region": os.environ.get("AWS_REGION") or os.environ.get("AWS_DEFAULT_REGION", ""),
        "scheme": parts.scheme,
    }
    return {name: value for name, value in options.items() if value}


def durable_dataset(text: str) -> Location:
    """The same; a relative path is refused where `durable` refuses it."""
    place = dataset_location(text)
    if isinstance(place, Path):
        durable(place)
        return place.absolute()
    return place


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
    str, typer.Option("--setup", help=f"{', '.join(setups.MODULES)}, or a module of your own.")
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


def settings_of(config: Path | None, overrides: list[str] | None) -> Settings:
    """The settings of a command."""
    return load_settings(config, overrides or [])


def setup_of(name: str, bad: str = "") -> Setup:
    """The setup of that name, with G_bad of that name unless it is ""; an unknown one is a usage error.

    Users' modules are found in the working directory too, after everything that is installed.
    """
    sys.path.append(str(Path.cwd()))
    with usage_errors():
        return with_bad(setups.load(name), bad)


def working(setup: Setup, seed: int) -> Setup:
    """The setup, tried out if users supplied a part of it: before anything starts or claims a folder.

    Raises:
        UserError: it does not work.
    """
    from workers.collection import require_working

    try:
        require_working(setup, seed)
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error
    return setup


@contextmanager
def interruptible(consequence: str = KEPT) -> Iterator[None]:
    """Ends a long command that was asked to stop with one sentence and the usual exit code.

    Args:
        consequence: what that means, the rest of the sentence.
    """
    try:
        yield
    except (KeyboardInterrupt, SystemExit) as stop:
        say(f"stopped: {consequence}")
        raise SystemExit(stop.code if isinstance(stop, SystemExit) else INTERRUPTED) from None


@contextmanager
def usage_errors() -> Iterator[None]:
    """Turns an unknown name or an impossible value into a usage error with the same message."""
    try:
        yield
    except (LookupError, ValueError) as error:
        raise UsageError(error.args[0]) from error
