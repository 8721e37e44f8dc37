"""What a robot has gone through, by its ledger: for the person who decides when to look at its motors."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from workers.host.ledger import LedgerEntry
from workers.host.serve import BROKEN, ENDED, STARTED


@dataclass(frozen=True)
class Wear:
    """Counters of a robot.

    Attributes:
        trials: that moved it.
        broken: that did not come to their end.
        commands: that were sent.
        seconds: in motion.
        travel: sum of all changes of each joint or coordinate, by name, in rad or m.
    """

    trials: int = 0
    broken: int = 0
    commands: int = 0
    seconds: float = 0.0
    travel: Mapping[str, float] = field(default_factory=dict)


def wear(entries: list[LedgerEntry]) -> Wear:
    """Count what a robot's ledger tells.

    Args:
        entries: of the ledger; those that earlier versions wrote tell less.

    Returns:
        The counters.
    """
    ends = [entry for entry in entries if entry.event in (ENDED, BROKEN)]
    travel: Counter[str] = Counter()
    for entry in ends:
        travel.update({str(name): float(value) for name, value in entry.facts.get("travel", {}).items()})
    return Wear(
        trials=sum(entry.event == STARTED for entry in entries),
        broken=sum(entry.event == BROKEN for entry in entries),
        commands=sum(int(entry.facts.get("commands", 0)) for entry in ends),
        seconds=sum((float(entry.facts.get("seconds", 0.0)) for entry in ends), 0.0),
        travel=dict(travel),
    )
