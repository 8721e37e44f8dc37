"""Files that a power cut leaves whole or absent."""

import fcntl
import os
import threading
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


def replace(path: Path, content: bytes, mode: int = 0o666) -> None:
    """Write a file whole, or leave it as it was.

    Args:
        path: of the file.
        content: all of it.
        mode: permissions of the file, from which the user's mask takes some away.

    Raises:
        OSError: the disk is full or broken.
    """
    unfinished = _beside(path)
    try:
        with open(unfinished, "wb", opener=lambda name, flags: os.open(name, flags, mode)) as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    sync_folder(path.parent)


def create(path: Path, content: bytes) -> bool:
    """Write a file, unless there is one; of several who try at once, one succeeds.

    Others see it at once, and a slow disk delays nobody; it is on disk after `sync`.

    Args:
        path: of the file.
        content: all of it.

    Returns:
        Whether it was not there before.

    Raises:
        OSError: the disk is full or broken.
    """
    unfinished = _beside(path)
    try:
        unfinished.write_bytes(content)
        try:
            os.link(unfinished, path)
        except FileExistsError:
            return False
        except OSError:  # a file system without hard links
            unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)
    return True


def sync(path: Path) -> None:
    """Make a file and its name durable.

    Raises:
        OSError: there is none, or the disk is broken.
    """
    with path.open("rb") as file:
        os.fsync(file.fileno())
    sync_folder(path.parent)


def _beside(path: Path) -> Path:
    return path.with_name(f"{path.name}.{os.getpid()}-{threading.get_ident()}.unfinished")


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
