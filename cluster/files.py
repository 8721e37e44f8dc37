"""Files that appear whole: written beside their place, then moved there."""

import errno
import fcntl
import json
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from cluster.errors import UserError
from svaedc.analysis.strict_json import json_values
from workers.dataset.storage.atomic import synchronise

DISK_ERRORS = frozenset(
    {
        *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EACCES),
        *(errno.EIO, errno.ESTALE, errno.ENOTCONN),  # a network's file system that is away
    }
)
"""An `OSError` of these is the disk's fault: no further attempt changes it."""


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Where to write a file that takes the place of `path`, durably, once the block has ended well.

    One process at a time may do so. What a killed one left behind, the next overwrites.
    """
    unfinished = path.with_name(f".unfinished-{path.name}")
    try:
        yield unfinished
        synchronise(unfinished)
        unfinished.replace(path)
        synchronise(path.parent)
    finally:
        unfinished.unlink(missing_ok=True)


@contextmanager
def alone_in(folder: Path, refusal: str) -> Iterator[None]:
    """Keeps other commands of this machine out of an existing folder for as long as the block lasts.

    Args:
        folder: that is locked; what is below it is not.
        refusal: what another command is told meanwhile, with the remedy.

    Yields:
        Nothing.

    Raises:
        UserError: another command works in the folder.
    """
    with ExitStack() as stack:
        try:
            stack.enter_context(_lock(folder, fcntl.LOCK_EX | fcntl.LOCK_NB))
        except BlockingIOError as error:
            raise UserError(refusal) from error
        yield


@contextmanager
def turn_in(folder: Path) -> Iterator[None]:
    """Lets commands of this machine into a folder one after the other; it is created first."""
    folder.mkdir(parents=True, exist_ok=True)
    with _lock(folder, fcntl.LOCK_EX):
        yield


@contextmanager
def _lock(folder: Path, operation: int) -> Iterator[None]:
    """Holds the kernel's lock on a folder itself: `filelock` would leave a file of its own in it.

    The lock is that of this process, which no program that it starts inherits: it ends
    with the process, however that ends.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, operation)
        yield
    finally:
        os.close(descriptor)


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Turns a folder of results that is full or read-only into one message.

    Args:
        folder: that `--out` names.

    Yields:
        Nothing.

    Raises:
        UserError: something in it cannot be written.
    """
    try:
        yield
    except OSError as error:
        raise disk_error(folder, str(error)) from error


def disk_error(folder: Path, reason: str) -> UserError:
    """The message for a folder of results that cannot be written, with the remedy.

    Args:
        folder: that `--out` names.
        reason: what the disk said.

    Returns:
        The error, to be raised.
    """
    return UserError(
        f"cannot write to {folder}: {reason}; make room, or choose another folder with --out. "
        "Everything finished is kept, and the same command goes on"
    )


def write_text(path: Path, text: str) -> None:
    """Write a file as a whole; what was there stays when there is no room.

    Args:
        path: of the file.
        text: its content.

    Raises:
        OSError: it cannot be written.
    """
    with replacing(path) as unfinished:
        unfinished.write_text(text, encoding="utf-8")


def json_text(content: Any, indent: int | None = 2) -> str:
    """JSON that every reader takes: a number that is not finite, for which JSON has no word, becomes null.

    Args:
        content: plain values.
        indent: spaces of a level; None for one line.

    Returns:
        Text without a line end.
    """
    return json.dumps(json_values(content), indent=indent, allow_nan=False)


def write_json(path: Path, content: dict[str, Any]) -> None:
    """Write a file as a whole; what was there stays when there is no room.

    Args:
        path: of the file.
        content: plain values.

    Raises:
        OSError: it cannot be written.
    """
    write_text(path, json_text(content) + "\n")


def read_json(path: Path) -> dict[str, Any]:
    """What `write_json` wrote; nothing where there is none, or a damaged one that can be made again."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, ValueError):
        return {}
    return content if isinstance(content, dict) else {}
