"""The folder of a comparison: it holds one comparison, and one command at a time works in it."""

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cluster import files
from cluster.comparison.records import RUNS
from cluster.errors import UserError
from cluster.files import replacing

IDENTITY = "comparison.json"


@contextmanager
def writing(folder: Path) -> Iterator[None]:
    """Turns a disk that is full or read-only into one message."""
    try:
        yield
    except OSError as error:
        raise disk_error(folder, str(error)) from error


def disk_error(folder: Path, reason: str) -> UserError:
    """The message for a folder that cannot be written, with the remedy."""
    return UserError(
        f"cannot write to {folder}: {reason}; make room, or choose another folder with --out. "
        "Everything finished is kept, and the same command goes on"
    )


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keeps other commands out of the folder, which is created first; a dead one keeps nobody out.

    Raises:
        UserError: another command works in it, or it cannot be written.
    """
    with writing(folder):
        (folder / RUNS).mkdir(parents=True, exist_ok=True)
    refusal = (
        f"another comparison is at work in {folder}; wait for its end, or choose another folder with --out"
    )
    with files.alone_in(folder, refusal):
        yield


def claim(folder: Path, identity: Mapping[str, Any], model: str) -> dict[str, Any]:
    """Begin a comparison in a folder, or check that the one in it is this one; returns its identity.

    Args:
        folder: of the comparison.
        identity: what all its runs have in common.
        model: hash of the model; "" when no method asked for needs one. It becomes part of the comparison
            with the first method that does.

    Raises:
        UserError: the folder holds another comparison, or its `comparison.json` is damaged or gone.
    """
    path = folder / IDENTITY
    found = _read(path, identity) if _has_runs(folder) else {**identity, "model": ""}
    wanted = {**identity, "model": model or found["model"]}
    for name, value in wanted.items():
        if found[name] not in (value, ""):
            raise UserError(
                f"{folder} holds a comparison with {name} {found[name]!r}, not {value!r}; "
                "choose another folder with --out"
            )
    if wanted != found or not path.exists():
        with writing(folder), replacing(path) as unfinished:
            unfinished.write_text(json.dumps(wanted, indent=2) + "\n")
    return wanted


def _has_runs(folder: Path) -> bool:
    return (folder / IDENTITY).exists() or any((folder / RUNS).iterdir())


def _read(path: Path, identity: Mapping[str, Any]) -> dict[str, Any]:
    try:
        found = {"setup_digest": "", **json.loads(path.read_text())}  # which earlier comparisons lack
        return {name: found[name] for name in (*identity, "model")}
    except FileNotFoundError as error:
        reason = "is gone, though there are runs"
        raise _unknown(path, reason) from error
    except (ValueError, TypeError, KeyError) as error:
        raise _unknown(path, "is damaged") from error


def _unknown(path: Path, reason: str) -> UserError:
    return UserError(
        f"{path} {reason}: what the runs beside it belong to cannot be known; put the file back, "
        "or choose another folder with --out"
    )
