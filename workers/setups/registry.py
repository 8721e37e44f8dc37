"""Setups by name: those that ship, those of installed packages, and those of a user's own modules."""

import hashlib
import inspect
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, Final, cast

from workers import plug_ins
from workers.plug_ins import Kind, Part
from workers.setups.names import SETUPS
from workers.user_modules import call, import_user_module

if TYPE_CHECKING:
    from workers.setups.setup import Setup

__all__ = ["KIND", "file_digest", "import_user_module", "load"]

KIND: Final = Kind("setup", "svaedc.setups", SETUPS)


def load(name: str) -> "Setup":
    """The setup of that name.

    It is one that ships; or the entry point of that name of an installed package, in the group
    `svaedc.setups`; or `module:name`, a Setup in that module or a function that returns one; or an importable
    module that offers `setup()`. One that does not ship has the digest of its file as its `code`.

    Raises:
        LookupError: there is none (it names the nearest), or it is not as it must be.
    """
    if name in SETUPS:
        module, _, function = SETUPS[name].partition(":")
        return getattr(import_module(module), function)()
    part = find(name)
    return replace(_setup_of(part), name=name, code=part.code)


def find(name: str) -> Part:
    """What the name of a setup leads to that does not ship; raises as `load` does."""
    if _is_offered(name) or not _is_module(name):
        try:
            return plug_ins.find(name, KIND)
        except LookupError as error:
            if _is_offered(name):
                raise
            raise LookupError(
                f"{error.args[0]}; nor is there a module of that name to import, neither here ({Path.cwd()}) "
                "nor on PYTHONPATH"
            ) from error
    return plug_ins.module_part(name)


def file_digest(part: object) -> str:
    """SHA-256 of the file that defines a module or function."""
    return hashlib.sha256(Path(inspect.getfile(cast(Any, part))).read_bytes()).hexdigest()


def _setup_of(part: Part) -> "Setup":
    from workers.setups.setup import Setup

    if isinstance(part.value, Setup):
        return part.value
    is_module = isinstance(part.value, ModuleType)
    function = getattr(part.value, "setup", None) if is_module else part.value
    made = call(part.name, function) if callable(function) else None
    if not isinstance(made, Setup):
        raise LookupError(
            f"module {part.name!r} must offer a function setup() that returns a workers.setups.Setup"
            if is_module
            else f"{part.name} must be a workers.setups.Setup or a function without arguments that returns "
            f"one, got {type(function if made is None else made).__name__}"
        )
    return made


def _is_offered(name: str) -> bool:
    """Whether it is `module:name`, or a name that packages offer."""
    return ":" in name or any(each.name == name for each in KIND.offers)


def _is_module(name: str) -> bool:
    parts = name.split(".")
    return all(part.isidentifier() for part in parts) and (len(parts) > 1 or find_spec(name) is not None)
