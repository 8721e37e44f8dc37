"""Sockets of a cluster that is started here: a path too long for Linux is refused before Ray starts."""

import os
import tempfile
from pathlib import Path

from cluster.config import Part, RaySettings
from cluster.errors import UserError

LONGEST = 107
"""The path of a socket may have so many bytes on Linux."""
_IN_SESSION = "session_2026-01-31_23-59-59_123456_{process}/sockets/{name}"
_NAME, _DASHBOARD_NAME = "plasma_store", "dash_TaskEventsHead"
"""The longest names that Ray gives to its sockets, and that its dashboard does."""
_IN_TEMPORARY_FILES = "pymp-12345678/listener-12345678"
"""Python's `multiprocessing` puts a socket here, with which Ray's dashboard starts its parts."""


def require_short_paths(settings: RaySettings, parts: tuple[Part, ...]) -> None:
    """Refuses folders below which a socket's path is too long; Ray would try for a minute and tell it wrong.

    Args:
        settings: with the folder of Ray's own files.
        parts: of the cluster that is to be started.

    Raises:
        UserError: a path is too long; the message says which, and what to set instead.
    """
    name = _DASHBOARD_NAME if "dashboard" in parts else _NAME
    _require(
        settings.temporary_folder,
        _IN_SESSION.format(process=os.getpid(), name=name),
        "name one of at most {room} with --set ray.temporary_folder=DIR",
    )
    if "dashboard" in parts:
        _require(
            Path(tempfile.gettempdir()),
            _IN_TEMPORARY_FILES,
            "set TMPDIR to one of at most {room}, such as /tmp",
        )


def _require(folder: Path, below: str, remedy: str) -> None:
    room = LONGEST - len(below) - 1
    length = len(os.fsencode(folder))
    if length > room:
        raise UserError(
            f"Ray cannot start here: its sockets lie below {folder}, a path of {length} bytes, and theirs "
            f"may have {LONGEST} in all; {remedy.format(room=room)}"
        )
