"""PyBullet without the banner that its C code prints when it is loaded; import it from here."""

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_STANDARD_ERROR = 2


@contextmanager
def _silent() -> Iterator[None]:
    """Sends to nowhere what C code writes to standard error, where the banner goes; errors are exceptions."""
    try:
        kept = os.dup(_STANDARD_ERROR)
    except OSError:  # this process has closed it
        yield
        return
    if sys.stderr is not None:
        sys.stderr.flush()
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, _STANDARD_ERROR)
    try:
        yield
    finally:
        os.dup2(kept, _STANDARD_ERROR)
        os.close(kept)
        os.close(nowhere)


with _silent():
    import pybullet

__all__ = ["pybullet"]
