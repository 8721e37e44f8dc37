"""Files that a power cut leaves whole or absent."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


def append(path: Path, content: bytes) -> None:
    """Add bytes to a file; they are on disk when this returns, and none of them is there when it raises.

    Args:
        path: of the file, which need not exist.
        content: what is added.

    Raises:
        OSError: the disk is full or broken.
    """
    is_new = not path.exists()
    with path.open("ab", buffering=0) as file:
        length = file.seek(0, os.SEEK_END)
        try:
            written = file.write(content)
            if written != len(content):
                raise OSError(f"only {written} of {len(content)} bytes could be written to {path}")
            os.fsync(file.fileno())
        except OSError:
            file.truncate(length)
            raise
    if is_new:
        sync_folder(path.parent)


def replace(path: Path, content: bytes) -> None:
    """Write a file whole, or leave it as it was.

    Args:
        path: of the file.
        content: all of it.

    Raises:
        OSError: the disk is full or broken.
    """
    unfinished = path.with_name(f"{path.name}.{os.getpid()}.unfinished")
    try:
        with unfinished.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Make the names in a folder durable, not only the bytes of its files."""
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)


@contextmanager
def exclusively(path: Path) -> Iterator[None]:
    """Wait until nobody else is in this block with the same file, and keep others out; death lets them in."""
    with path.open("ab") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield
