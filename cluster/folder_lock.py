"""The lock on a folder: one command at a time works in it, and its death frees the lock."""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cluster.errors import UserError


@contextmanager
def alone_in(folder: Path, refusal: str) -> Iterator[None]:
    """Keeps other commands of this machine out of an existing folder for as long as the block lasts.

    The kernel holds the lock for this process's descriptor of the folder, which no other program that it
    starts inherits: it ends with the process, however that ends, and leaves no file behind.

    Args:
        folder: that is locked; what is below it is not.
        refusal: what another command is told meanwhile, with the remedy.

    Raises:
        UserError: another command works in the folder.
    """
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise UserError(refusal) from error
        yield
    finally:
        os.close(descriptor)
