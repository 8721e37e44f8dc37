"""The states of a hardware trial and the only ways from one to another."""

from collections.abc import Mapping
from enum import StrEnum
from types import MappingProxyType


class State(StrEnum):
    """Where a trial stands; see `LEGAL` for what may follow."""

    PROPOSED = "proposed"
    CHECKED = "checked"
    APPROVED = "approved"
    GRANTED = "granted"
    RUNNING = "running"
    MEASURED = "measured"
    FAILED = "failed"
    ABORTED = "aborted"
    REJECTED = "rejected"
    UNKNOWN = "unknown"


# No edge leads from running or unknown back to approved: a repetition is a new trial with its own approval.
LEGAL: Mapping[State | None, frozenset[State]] = MappingProxyType(
    {
        None: frozenset({State.PROPOSED}),
        State.PROPOSED: frozenset({State.CHECKED, State.REJECTED}),
        State.CHECKED: frozenset({State.APPROVED, State.REJECTED}),
        State.APPROVED: frozenset({State.GRANTED, State.CHECKED, State.REJECTED}),
        State.GRANTED: frozenset({State.APPROVED, State.RUNNING, State.UNKNOWN}),
        State.RUNNING: frozenset({State.MEASURED, State.FAILED, State.ABORTED, State.UNKNOWN}),
        State.UNKNOWN: frozenset({State.MEASURED, State.FAILED, State.ABORTED}),
        State.MEASURED: frozenset({State.MEASURED}),  # amended by a person; the old value stays in the events
        State.FAILED: frozenset(),
        State.ABORTED: frozenset(),
        State.REJECTED: frozenset(),
    }
)

# In these the robot may move or may have moved: at most one trial of a robot is in any of them.
ACTIVE = frozenset({State.GRANTED, State.RUNNING, State.UNKNOWN})
TERMINAL = frozenset({State.MEASURED, State.FAILED, State.ABORTED, State.REJECTED})


IMPORTED = "imported"
"""The kind of a trial that another campaign measured."""


def legal(old: State | None, kind: str) -> frozenset[State]:
    """Where a trial may go.

    Args:
        old: state before; None where the trial does not exist yet.
        kind: of the trial.

    Returns:
        What `LEGAL` has; an imported trial is measured as soon as it is proposed, and moves nothing.
    """
    if kind == IMPORTED and old is State.PROPOSED:
        return frozenset({State.MEASURED})
    return LEGAL[old]


class Approval(StrEnum):
    """Who lets a checked controller onto the robot."""

    POLICY = "policy"
    OPERATOR = "operator"
