"""What a robot must not do, whatever a controller wants: checked on plans and commands, never clipped."""

import hashlib
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from workers.host.ledger import canonical

ALL = "*"
"""This name in a table of limits stands for every channel that it does not name."""
KINDS = ("position", "speed", "acceleration", "torque", "workspace")
_RANGES = ("position", "workspace")
_NUMBERS = ("duration", "rest", "trials_per_hour", "trials_per_day", "silence")


@dataclass(frozen=True)
class HostChannel:
    """One number of a plan or a command.

    Attributes:
        name: of the joint, or of the coordinate of the hand.
        kind: position (rad or m), speed (rad/s or m/s), torque (Nm) or workspace (m); "" for what no limit
            knows.
        unit: for people.
    """

    name: str
    kind: str
    unit: str


@dataclass(frozen=True)
class RobotLimits:
    """The limits of one robot.

    Attributes:
        tables: by kind and channel: a largest absolute value, or for position and workspace a range.
        duration: longest duration of a trial, in s.
        rest: least time between the starts of two trials, in s.
        trials_per_hour: most starts in any hour.
        trials_per_day: most starts in any 24 hours.
        silence: s without a sign of life of whoever drives the host, after which it stops; 0 for the usual.
    """

    tables: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    duration: float = math.inf
    rest: float = 0.0
    trials_per_hour: float = math.inf
    trials_per_day: float = math.inf
    silence: float = 0.0

    @classmethod
    def read(cls, values: Mapping[str, Any], source: str) -> "RobotLimits":
        """Check what a file of limits says.

        Args:
            values: of the file, by name.
            source: its name, for errors.

        Returns:
            The limits.

        Raises:
            ValueError: a name is unknown, or a value is no limit; the message names both and the remedy.
        """
        known = (*KINDS, *_NUMBERS)
        unknown = [name for name in values if name not in known]
        if unknown:
            raise ValueError(f"{source}: {unknown[0]!r} is no limit; there are {', '.join(known)}")
        tables = {kind: _table(values[kind], kind, source) for kind in KINDS if kind in values}
        numbers = {name: _number(values[name], name, source) for name in _NUMBERS if name in values}
        return cls(tables, **numbers)

    def facts(self) -> dict[str, Any]:
        """Plain values, as `read` takes them."""
        numbers = {name: getattr(self, name) for name in _NUMBERS}
        return {
            **{kind: dict(table) for kind, table in self.tables.items()},
            **{name: value for name, value in numbers.items() if math.isfinite(value) and value != 0.0},
        }

    @property
    def sha256(self) -> str:
        """Of the limits' values; approvals are bound to it."""
        return hashlib.sha256(canonical(self.facts())).hexdigest()

    def of(self, kind: str, name: str) -> Any:
        """Look up one limit.

        Args:
            kind: of the channel.
            name: of the channel.

        Returns:
            The largest absolute value, or the range; None where there is no limit.
        """
        table = self.tables.get(kind, {})
        return table.get(name, table.get(ALL))

    def margin(self, channel: HostChannel, low: float, high: float) -> "float | None":
        """How far values stay inside a channel's own limit.

        Args:
            channel: whose values.
            low: the lowest.
            high: the highest.

        Returns:
            The least distance to the limit; None where there is none.
        """
        limit = self.of(channel.kind, channel.name)
        if limit is None:
            return None
        lowest, highest = limit if channel.kind in _RANGES else (-limit, limit)
        return float(min(low - lowest, highest - high))

    def wait_seconds(self, starts: Iterable[float], now: float) -> float:
        """How long the robot must rest before its next trial.

        Args:
            starts: times of all starts so far, in s since any fixed moment.
            now: the present, in the same seconds; a clock that was set back counts as no time passed.

        Returns:
            0 where it may start now.
        """
        past = sorted(starts)
        due = [past[-1] + self.rest] if past else []
        for most, period in ((self.trials_per_hour, 3600.0), (self.trials_per_day, 86_400.0)):
            if len(past) >= most:
                due.append(past[-int(most)] + period if most >= 1 else math.inf)
        return max([0.0, *(moment - now for moment in due)])


class LimitWatch:
    """Looks at rows of a plan or at commands, one after the other, and objects to what is not allowed.

    Args:
        limits: of the robot.
        channels: of every row, in order.
        period: s between two rows.
    """

    def __init__(self, limits: RobotLimits, channels: Sequence[HostChannel], period: float) -> None:
        self._limits = limits
        self._channels = tuple(channels)
        self._period = period
        self._last: Sequence[float] | None = None
        self._rates: list[float] | None = None

    def objection(self, row: Sequence[Any]) -> str:
        """Say why a row must not reach the robot.

        Args:
            row: one value per channel.

        Returns:
            The reason, with the value and the limit; "" when it may.
        """
        if len(row) != len(self._channels):
            return f"a command must have {len(self._channels)} values, got {len(row)}"
        for channel, value in zip(self._channels, row):  # noqa: B905 - the lengths are equal
            if not isinstance(value, (int, float)) or isinstance(value, bool) or not math.isfinite(value):
                return f"{channel.name} must be a finite number, got {value!r}"
            found = self._beyond(channel.kind, channel, float(value))
            if found:
                return found
        return self._change(row)

    def _change(self, row: Sequence[Any]) -> str:
        """Speeds of positions, and accelerations of both, between this row and those before."""
        if self._last is None:
            self._last = list(row)
            return ""
        rates = [(new - old) / self._period for new, old in zip(row, self._last)]  # noqa: B905
        for number, channel in enumerate(self._channels):
            found = self._too_fast(channel, rates[number], self._rates[number] if self._rates else None)
            if found:
                return found
        self._last, self._rates = list(row), rates
        return ""

    def _too_fast(self, channel: HostChannel, rate: float, before: "float | None") -> str:
        if channel.kind == "speed":
            return self._beyond("acceleration", channel, rate)
        if channel.kind != "position":
            return ""
        found = self._beyond("speed", channel, rate)
        if found or before is None:
            return found
        return self._beyond("acceleration", channel, (rate - before) / self._period)

    def _beyond(self, kind: str, channel: HostChannel, value: float) -> str:
        limit = self._limits.of(kind, channel.name)
        if limit is None:
            return ""
        low, high = limit if kind in _RANGES else (-limit, limit)
        if low <= value <= high:
            return ""
        return f"the {kind} of {channel.name} must lie in [{low:g}, {high:g}], got {value:.6g}"


def first_objection(watch: LimitWatch, rows: Iterable[Sequence[Any]]) -> str:
    """Look at a whole plan.

    Args:
        watch: that has seen nothing yet.
        rows: of the plan.

    Returns:
        What is wrong with the first row that must not reach the robot, and which it is; "" when all may.
    """
    for number, row in enumerate(rows):
        found = watch.objection(row)
        if found:
            return f"step {number}: {found}"
    return ""


def _table(value: Any, kind: str, source: str) -> dict[str, Any]:
    if not isinstance(value, Mapping):
        raise ValueError(f"{source}: {kind} must be a table of limits by joint, got {value!r}")
    return {str(name): _limit(each, kind, f"{source}: {kind} of {name}") for name, each in value.items()}


def _limit(value: Any, kind: str, what: str) -> Any:
    if kind in _RANGES:
        if not isinstance(value, (list, tuple)) or len(value) != 2 or not all(map(_is_number, value)):
            raise ValueError(f"{what} must be two numbers [low, high], got {value!r}")
        if not value[0] < value[1]:
            raise ValueError(f"{what} must have low < high, got {value!r}")
        return [float(value[0]), float(value[1])]
    if not _is_number(value) or value <= 0:
        raise ValueError(f"{what} must be a number above 0, got {value!r}")
    return float(value)


def _number(value: Any, name: str, source: str) -> float:
    if not _is_number(value) or value < 0 or (name == "duration" and value == 0):
        raise ValueError(f"{source}: {name} must be a number above 0, got {value!r}")
    return float(value)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
