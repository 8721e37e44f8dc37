"""What there is by name: setups, methods and robots, those that ship and those of installed packages."""

import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from importlib import import_module

from cluster.inputs import search_working_directory
from cluster.optimization import methods
from svaedc.bo.method_names import SUMMARIES
from workers.plug_ins import Kind, Part, find, offer, package_of
from workers.setups import SETUPS, registry

NEEDS_MODEL = "needs a model"
NEEDS_CANDIDATES = "needs candidates"


@dataclass(frozen=True)
class Listed:
    """One line of a list.

    Attributes:
        name: by which it is asked for.
        facts: its size, or what it needs; "" for nothing.
        summary: one line about it, or why it cannot be used.
        source: the package it comes from, and where in it; "" for what ships.
    """

    name: str
    facts: str
    summary: str
    source: str = ""


def listed_setups() -> Iterator[Listed]:
    """Every setup with its number of parameters and steps; each is made for it."""
    for name, place in SETUPS.items():
        module, _, function = place.partition(":")
        made = getattr(import_module(module), function)
        yield Listed(name, _size(name), (inspect.getdoc(made) or "").partition("\n")[0])
    yield from _plug_ins(registry.KIND, lambda part: _size(part.name))


def listed_methods() -> Iterator[Listed]:
    """Every method; those that ship are not imported for it."""
    for name, summary in SUMMARIES.items():
        yield Listed(name, _needs_of(name), summary)
    yield from _plug_ins(methods.KIND, lambda part: NEEDS_MODEL if methods.needs_model(part.name) else "")


def _needs_of(method: str) -> str:
    """What a method that ships cannot do without."""
    needs = ((NEEDS_CANDIDATES, methods.needs_candidates), (NEEDS_MODEL, methods.needs_model))
    found = [words for words, is_needed in needs if is_needed(method)]
    return " and ".join(found).replace(" and needs ", " and ")


def listed_robots() -> Iterator[Listed]:
    """Every robot, with the setup that it realises."""
    from workers.hardware import robots

    for robot in robots.ROBOTS.values():
        yield Listed(robot.name, f"realises {robot.setup}", robots.STAND_IN)
    yield Listed(f"{robots.REHEARSAL}SETUP", "realises SETUP", f"{robots.STAND_IN}, of any setup")
    yield from _plug_ins(robots.KIND, lambda part: f"realises {robots.find(part.name).setup}")


def _size(setup: str) -> str:
    made = registry.load(setup)
    return f"{made.dimensions}-D, {made.horizon} steps"


def _plug_ins(kind: Kind, facts: Callable[[Part], str]) -> Iterator[Listed]:
    """What packages offer; one that is broken is listed with its error."""
    search_working_directory()
    for name in dict.fromkeys(each.name for each in kind.offers):
        entries = [each for each in kind.offers if each.name == name]
        source = ", ".join(sorted(f"{package_of(each)}: {each.value}" for each in entries))
        try:
            offer(name, kind)  # refuses a name that ships, and one of two packages
            part = find(name, kind)
            yield Listed(name, facts(part), part.summary, source)
        except (LookupError, ValueError, OSError) as error:
            yield Listed(name, "", f"error: {error.args[0] if error.args else error}", source)
