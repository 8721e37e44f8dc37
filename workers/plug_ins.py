"""Parts by name: those that ship, those that installed packages offer, and anything in an importable module.

| written as | leads to |
|---|---|
| `name` | what ships under that name; else the entry point of that name, of an installed package |
| `module:name` | a function or an object of that module; `package.module:Class.name` goes deeper |

A name that ships cannot be taken by a package. Packages are looked through when a name is none that ships,
and no earlier: it costs time.
"""

import hashlib
import inspect
import re
import sys
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from workers.names import nearest, require_known
from workers.user_modules import import_user_module

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

_OFFERED = re.compile(r"\w[\w.-]*")


@dataclass(frozen=True)
class Kind:
    """What is looked for by name.

    Attributes:
        noun: what one of them is called, such as "setup".
        group: of the entry points by which packages offer some, such as "svaedc.setups".
        shipped: the names that ship.
    """

    noun: str
    group: str
    shipped: Collection[str]

    @property
    def offers(self) -> "tuple[EntryPoint, ...]":
        """What the packages on Python's path offer, by name; nothing of it is imported."""
        return _entry_points(self.group, tuple(sys.path))


@dataclass(frozen=True)
class Part:
    """What a name leads to.

    Attributes:
        name: that was asked for.
        value: the function, class, object or module.
        module: that it was found in.
    """

    name: str
    value: Any
    module: ModuleType

    @property
    def file(self) -> Path:
        """The file that defines it: its own if it is a function or class, that of its module if it is not.

        Raises:
            LookupError: there is none, as for what is built into Python.
        """
        has_own = inspect.isfunction(self.value) or inspect.isclass(self.value)
        try:
            return Path(inspect.getfile(inspect.unwrap(self.value) if has_own else self.module))
        except TypeError as error:
            raise LookupError(f"{self.name} must be Python code in a file, and has none") from error

    @property
    def code(self) -> str:
        """SHA-256 of that file."""
        return hashlib.sha256(self.file.read_bytes()).hexdigest()

    @property
    def summary(self) -> str:
        """The first line of its docstring, or of its module's."""
        is_documented = inspect.isfunction(self.value) or inspect.isclass(self.value)
        text = inspect.getdoc(self.value if is_documented else self.module)
        return (text or "").strip().partition("\n")[0]


def find(name: str, kind: Kind) -> Part:
    """What a name leads to that is none of those that ship.

    Args:
        name: of an entry point, or `module:name`.
        kind: of what is looked for.

    Returns:
        What was found, imported.

    Raises:
        LookupError: nothing has this name, two packages offer it, or what it leads to cannot be imported.
    """
    return _import_part(name, name if ":" in name else offer(name, kind).value)


def module_part(name: str) -> Part:
    """An importable module as a whole; raises as `find` does."""
    module = import_user_module(name)
    return Part(name, module, module)


def offer(name: str, kind: Kind) -> "EntryPoint":
    """The one entry point of that name.

    Args:
        name: of the entry point.
        kind: of what it offers.

    Returns:
        The entry point, not yet imported.

    Raises:
        LookupError: there is none (it names the nearest of all names that there are), more than one, or one
            that nobody can ask for.
    """
    found = sorted((each for each in kind.offers if each.name == name), key=package_of)
    if not found:
        require_known(name, kind.noun, dict.fromkeys([*kind.shipped, *(each.name for each in kind.offers)]))
    instead = " or ".join(each.value for each in found)
    if name in kind.shipped:
        raise LookupError(
            f"svaedc ships a {kind.noun} {name!r}, which is meant by it: say {instead} for this"
        )
    if len(found) > 1:
        packages = " and ".join(map(package_of, found))
        raise LookupError(
            f"{packages} both offer a {kind.noun} {name!r}: uninstall one of them, or say {instead}"
        )
    if not _OFFERED.fullmatch(name):
        raise LookupError(
            f"{package_of(found[0])} offers a {kind.noun} {name!r}, and a name may have letters, digits, "
            f"'_', '-' and '.' only: say {instead}"
        )
    return found[0]


def package_of(entry: "EntryPoint") -> str:
    """The package that offers it, with its version."""
    facts: Any = {}
    with suppress(OSError):  # newer versions of the library raise where there is no METADATA
        facts = entry.dist.metadata if entry.dist else {}
    known = [facts[fact] for fact in ("Name", "Version") if fact in facts]
    return " ".join(known) or "a package without a name"


def file_name(name: str, kind: Kind) -> str:
    """The file that a name leads to, for messages; nothing is imported for it.

    Args:
        name: as for `find`, or that of a module.
        kind: of what it names.

    Returns:
        The name of the file if its module is loaded, words for it if it is not.
    """
    offers = [] if ":" in name else [each.value for each in kind.offers if each.name == name]
    target, _, attributes = (offers[0] if offers else name).partition(":")
    module = sys.modules.get(target)
    if module is None:
        return f"the file of the {kind.noun} {name!r}"
    value: Any = module
    for attribute in filter(None, attributes.split(".")):
        value = getattr(value, attribute, module)
    return Part(name, value, module).file.name


@cache
def _entry_points(group: str, path: tuple[str, ...]) -> "tuple[EntryPoint, ...]":  # noqa: ARG001
    """The entry points of a group; another path is another question."""
    from importlib.metadata import entry_points

    return tuple(sorted(entry_points(group=group), key=lambda each: (each.name, each.value)))


def _import_part(name: str, target: str) -> Part:
    """What `module:name` leads to."""
    module_name, colon, attributes = target.partition(":")
    parts = attributes.split(".") if colon else []
    if not all(each.isidentifier() for each in [*module_name.split("."), *parts]):
        raise LookupError(
            f"what is in a module must be named as module:name, such as my_module:my_name, got {target!r}"
        )
    module = import_user_module(module_name)
    value: Any = module
    for part in parts:
        if not hasattr(value, part):
            there = [key for key in dir(value) if not key.startswith("_")]
            raise LookupError(f"module {module_name!r} has no {attributes!r}; {nearest(part, there)}")
        value = getattr(value, part)
    return Part(name, value, module)
