"""Users' own modules: imported and called so that their mistakes are told with file and line."""

from collections.abc import Callable
from importlib import import_module
from types import ModuleType
from typing import Any

from workers.user_code import describe


def import_user_module(name: str) -> ModuleType:
    """A user's module.

    Raises:
        LookupError: there is none, or it fails; the message has the kind of error, its file and its line.
    """
    try:
        return import_module(name)
    except Exception as error:
        reason = f"{error}; {_REMEDY}" if _is_absent(name, error) else describe(error)
        raise LookupError(f"cannot import the module {name!r}: {reason}") from error


def call(name: str, function: Callable[..., Any], *arguments: Any) -> Any:
    """Call what a user wrote.

    Args:
        name: under which the user asked for it, for the error.
        function: of the user's.
        *arguments: that it takes.

    Returns:
        What it returns.

    Raises:
        LookupError: it fails; the message has the kind of error, its file and its line.
    """
    try:
        return function(*arguments)
    except Exception as error:
        raise LookupError(f"{name} failed with {describe(error)}") from error


_REMEDY = "it must be in the working directory or on PYTHONPATH, on every machine of the cluster"


def _is_absent(name: str, error: Exception) -> bool:
    """Whether it is this module that is not there, or a package it lies in, and not one that it imports."""
    missing = error.name if isinstance(error, ModuleNotFoundError) else None
    return missing is not None and f"{name}.".startswith(f"{missing}.")
