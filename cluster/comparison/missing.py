"""What a comparison lacks of the runs that were asked for."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from cluster.comparison.records import RunKey, Runs
from svaedc.analysis.words import enumeration, quantity

_NAMED = 6
"""A sentence names so many runs; nobody reads more."""


@dataclass(frozen=True)
class MissingRuns:
    """The runs that are not whole.

    Attributes:
        asked: runs asked for.
        length: trials of a whole run.
        made: trials of each run that is not whole; 0 where it has not begun.
    """

    asked: int
    length: int
    made: Mapping[RunKey, int]

    def __str__(self) -> str:
        """A sentence; nothing where all runs are whole."""
        if not self.made:
            return ""
        verb, whole = "is" if len(self.made) == 1 else "are", quantity(self.length, "trial")
        found = list(self._each())
        named = found if len(found) <= _NAMED else [*found[:_NAMED], f"{len(found) - _NAMED} more"]
        return (
            f"{len(self.made)} of {quantity(self.asked, 'run')} {verb} not whole ({whole} each): "
            f"{enumeration(named)}. `svaedc compare` goes on with them"
        )

    def _each(self) -> Iterator[str]:
        """Those that have begun come first."""
        for key, trials in sorted(self.made.items(), key=lambda item: item[1] == 0):
            yield f"{key} has {quantity(trials, 'trial')}" if trials else f"{key} has not begun"

    def as_json(self) -> list[dict[str, Any]]:
        """One entry for each run, as plain values."""
        return [
            {"method": key.method, "run": key.run, "trials": made, "of": self.length}
            for key, made in self.made.items()
        ]


def missing_runs(asked: Iterable[RunKey], runs: Runs, length: int) -> MissingRuns:
    """Look for the runs that are not whole.

    Args:
        asked: all runs asked for.
        runs: the trials that there are.
        length: trials of a whole run.

    Returns:
        Those with fewer trials, in the order in which they were asked for.
    """
    made = {key: len(runs.get(key, ())) for key in asked}
    return MissingRuns(len(made), length, {key: trials for key, trials in made.items() if trials < length})
