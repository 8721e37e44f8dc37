"""What users name: paths, datasets and setups, checked where they enter."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from cluster.errors import UsageError, UserError
from cluster.home import expand_home
from workers.setups.names import SETUPS

if TYPE_CHECKING:
    from workers.dataset.storage.location import Location
    from workers.setups import Setup


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
    with usage_errors():
        return expand_home(path).absolute()


def durable_each(paths: list[Path] | None) -> list[Path]:
    """The same of each of several paths."""
    return [path for path in map(durable, paths or ()) if path is not None]


def dataset_location(text: str) -> "Location":
    """Where a dataset lies: a folder, or `s3://bucket/prefix`.

    What the environment says of the store becomes part of its address, so that every process goes to the same
    one, wherever it runs. Credentials never do.

    Raises:
        UsageError: it has a scheme, but is no address of an object store.
    """
    from workers.dataset.storage.location import location

    try:
        place = location(text)
    except ValueError as error:
        raise UsageError(str(error)) from error
    if not isinstance(place, Path):
        return place.at(_store_of_environment())
    with usage_errors():
        return expand_home(place)


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


def durable_dataset(text: str) -> "Location":
    """The same; a relative path is refused where `durable` refuses it."""
    place = dataset_location(text)
    if isinstance(place, Path):
        durable(place)
        return place.absolute()
    return place


def setup_of(name: str, bad: str = "") -> "Setup":
    """Load the setup of that name.

    Users' modules are found in the working directory too, after everything that is installed.

    Args:
        name: of a setup that ships or of an installed package, `module:name`, or an importable module.
        bad: G_bad as `module:function`; "" for the setup's own.

    Returns:
        The setup, with that G_bad.

    Raises:
        UsageError: there is no such setup or G_bad, or a module is not as it must be.
    """
    from workers.setups.registry import load

    search_working_directory()
    with usage_errors():
        found = load(name)
        if not bad:
            return found
        from workers.setups.user_bad import with_bad

        return with_bad(found, bad)


def search_working_directory() -> None:
    """Let users' modules be found in the working directory too, after everything that is installed."""
    if str(Path.cwd()) not in sys.path:
        sys.path.append(str(Path.cwd()))


def require_working_setup(setup: "Setup", seed: int) -> "Setup":
    """Try a setup out if users supplied a part of it, before anything starts or claims a folder.

    Args:
        setup: what is tried.
        seed: of the dataset; its episode 0 is the one rolled out.

    Returns:
        The same setup.

    Raises:
        UserError: it does not work.
    """
    if setup.name in SETUPS and not setup.task.bad_name:
        return setup
    from workers.collection.shard import require_working

    try:
        require_working(setup, seed)
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error
    return setup


@contextmanager
def usage_errors() -> Iterator[None]:
    """Turns an unknown name or an impossible value into a usage error with the same message."""
    try:
        yield
    except (LookupError, ValueError) as error:
        raise UsageError(str(error.args[0]) if error.args else type(error).__name__) from error
