"""Which other processes are at work in a dataset: each says so by a file, as long as it lives."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from workers.dataset.storage.atomic import temporary_file
from workers.dataset.storage.location import Location
from workers.dataset.storage.temporary import WRITING, is_dead, writer

_NAME = "collecting"


@contextmanager
def presence(folder: Location) -> Iterator[None]:
    """Says that this process collects into a folder.

    In an object store it says nothing: nobody could tell the dead from the living there.

    Args:
        folder: of the dataset, which exists.

    Yields:
        Nothing, for as long as it is at work.
    """
    with temporary_file(folder, _NAME) as path:
        path.touch()
        yield


def others_at_work(folder: Location) -> list[Path]:
    """The files of other processes that collect into a folder and are not known to be dead."""
    if not isinstance(folder, Path) or not (folder / WRITING).exists():
        return []
    found = (folder / WRITING).glob(f"{_NAME}.*")
    return sorted(path for path in found if not is_dead(path.name) and not path.name.endswith(writer()))
