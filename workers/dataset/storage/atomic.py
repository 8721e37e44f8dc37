"""How a file comes to be, once and whole.

On a disk it is written under its writer's name, then linked to its own. In an object store it comes to its
name by one request, which leaves nothing if it fails; until then it is in its writer's memory, or under its
writer's name.
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from workers.dataset.storage.location import Location
from workers.dataset.storage.temporary import WRITING, writer


@contextmanager
def temporary_file(folder: Location, name: str) -> Iterator[Path]:
    """Offer a path for a file of this writer that is not finished; whatever lies there is removed at the end.

    Args:
        folder: of the dataset; on a disk it must exist.
        name: of the file once it is finished.

    Yields:
        A path on this machine: below the folder, or in memory for an object store.
    """
    if not isinstance(folder, Path):
        with _file_in_memory(name) as temporary:
            yield temporary
        return
    writing = folder / WRITING
    writing.mkdir(exist_ok=True)
    temporary = writing / f"{name}.{writer()}"
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _file_in_memory(name: str) -> Iterator[Path]:
    """A file that ends with this process, however that ends."""
    handle = os.memfd_create(name)
    try:
        yield Path(f"/proc/self/fd/{handle}")
    finally:
        os.close(handle)


def link(source: Location, target: Location) -> None:
    """Give a finished file its final name, durably, unless another writer was first.

    In an object store two writers at the same moment may both write, so the bytes must be the same.

    Args:
        source: the finished file.
        target: its final name.
    """
    if isinstance(source, Path) and isinstance(target, Path):
        with suppress(FileExistsError):
            os.link(source, target)
        synchronise(target.parent)
    elif not target.exists():
        target.write_bytes(source.read_bytes())


def move(source: Path, target: Location) -> None:
    """Let a finished file take the place of what has its final name.

    Args:
        source: the finished file.
        target: its final name.
    """
    if isinstance(target, Path):
        source.replace(target)
    else:
        target.write_bytes(source.read_bytes())


def synchronise(path: Location) -> None:
    """Wait until a file's bytes, or a folder's names, are on disk; objects are safe once they are there."""
    if not isinstance(path, Path):
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
