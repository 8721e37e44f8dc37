"""What a setup declares, as plain values, and what differs between two such declarations, in words."""

import math
from collections.abc import Iterable, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Final, NamedTuple

if TYPE_CHECKING:
    from workers.setups.setup import Setup

LONGEST: Final = 80
"""Longer values are cut."""
ABSENT: Final = "none"
_TOLD: Final = 4


class Change(NamedTuple):
    """One thing that differs.

    Attributes:
        what: differs.
        one: its value on one side.
        other: on the other.
    """

    what: str
    one: str
    other: str

    def __str__(self) -> str:
        """As two values, neither of which came first."""
        return f"{self.what}: {self.one} and {self.other}"

    @property
    def since(self) -> str:
        """As the value before and the value now."""
        return f"{self.what} was {self.one}, is {self.other}"


def declaration(setup: "Setup") -> dict[str, Any]:
    """All that a setup says of itself, as values of JSON."""
    return {
        "parameters": [
            [each.name, float(each.low), float(each.high)] for each in setup.controller.parameters
        ],
        "observation": [
            [each.name, each.unit, float(each.low), float(each.high)] for each in setup.observation
        ],
        "conditions": list(setup.conditions),
        "horizon": int(setup.horizon),
        "control_step": float(setup.control_step),
        "physics": _intervals(setup.physics.intervals),
        "gaps": {level: _intervals(ranges.intervals) for level, ranges in setup.gaps.items()},
        "objective_limits": [float(limit) for limit in setup.objective_limits],
        "success": float(setup.success),
        **({} if math.isnan(setup.broken) else {"broken": float(setup.broken)}),
    }


def changes(one: Mapping[str, Any], other: Mapping[str, Any]) -> Iterator[Change]:
    """What differs between two declarations.

    Args:
        one: plain values by name.
        other: the same of the other side.

    Yields:
        The fields that differ; of rows and mappings, the entries that do.
    """
    for name in dict.fromkeys([*one, *other]):
        mine, theirs = one.get(name), other.get(name)
        if mine != theirs:
            yield from _changes(name, mine, theirs)


def list_changes(differing: Iterable[Change]) -> str:
    """Say what differs, the first few things of many."""
    each = [str(change) for change in differing]
    more = [f"and {len(each) - _TOLD} more"] if len(each) > _TOLD else []
    return "; ".join([*each[:_TOLD], *more])


def what_changed(differing: Iterable[Change], noun: str) -> str:
    """Say what has changed of something whose file has.

    Args:
        differing: in what it declares.
        noun: what it is called, such as "setup".

    Returns:
        All of it, or that it is none of what is declared.
    """
    said = "; ".join(each.since for each in differing)
    return said or f"nothing that its {noun} declares: its code did"


def _changes(name: str, one: Any, other: Any) -> Iterator[Change]:
    mine, theirs = _entries(one), _entries(other)
    if mine is None or theirs is None:
        yield Change(name, _brief(one), _brief(other))
        return
    differing = [key for key in dict.fromkeys([*mine, *theirs]) if mine.get(key) != theirs.get(key)]
    for key in differing:
        yield from _changes(f"{name}: {key}", mine.get(key, ABSENT), theirs.get(key, ABSENT))
    if not differing:
        yield Change(f"the order of {name}", _brief(list(mine)), _brief(list(theirs)))


def _entries(value: Any) -> Mapping[str, Any] | None:
    """Rows by their first value, and mappings as they are; None for what has no named entries."""
    if isinstance(value, Mapping):
        return value
    if isinstance(value, list | tuple) and value and all(isinstance(row, list | tuple) for row in value):
        return {row[0]: row[1:] for row in value}
    return None


def _intervals(intervals: Mapping[str, tuple[float, float]]) -> dict[str, list[float]]:
    return {name: [float(low), float(high)] for name, (low, high) in intervals.items()}


def _brief(value: Any) -> str:
    text = str(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
