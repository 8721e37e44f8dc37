"""Setups by name: those that ship, and modules of a user's own."""

import hashlib
import inspect
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, cast

from workers.setups.names import SETUPS, require_known

if TYPE_CHECKING:
    from workers.setups.setup import Setup


def load(name: str) -> "Setup":
    """The setup of that name, or of the importable module of that name, which offers `setup()`.

    Raises:
        LookupError: there is neither (it names the nearest), or the module is not as it must be.
    """
    if name in SETUPS or not _is_module(name):
        module, _, function = SETUPS[_shipped_name(name)].partition(":")
        return getattr(import_module(module), function)()
    from workers.setups.setup import Setup

    made = getattr(import_user_module(name), "setup", lambda: None)()
    if not isinstance(made, Setup):
        raise LookupError(
            f"module {name!r} must offer a function setup() that returns a workers.setups.Setup"
        )
    return replace(made, name=name, code=file_digest(import_user_module(name)))


def _shipped_name(name: str) -> str:
    try:
        return require_known(name, "setup", SETUPS)
    except LookupError as error:
        raise LookupError(f"{error.args[0]}; nor is there a module of that name to import") from error


def import_user_module(name: str) -> ModuleType:
    """A user's module; one that cannot be imported raises `LookupError` with the reason."""
    try:
        return import_module(name)
    except (ImportError, SyntaxError) as error:
        raise LookupError(
            f"cannot import the module {name!r}: {error}; it must be in the working directory or on "
            "PYTHONPATH, on every machine of the cluster"
        ) from error


def file_digest(part: object) -> str:
    """SHA-256 of the file that defines a module or function."""
    return hashlib.sha256(Path(inspect.getfile(cast(Any, part))).read_bytes()).hexdigest()


def _is_module(name: str) -> bool:
    parts = name.split(".")
    return all(part.isidentifier() for part in parts) and (len(parts) > 1 or find_spec(name) is not None)
