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


def is_legal(old: State | None, new: State) -> bool:
    """Whether a trial may go from one state to another.

    Args:
        old: state before; None where the trial does not exist yet.
        new: state after.

    Returns:
        True where `LEGAL` has the transition.
    """
    return new in LEGAL[old]


class Approval(StrEnum):
    """Who lets a checked controller onto the robot."""

    POLICY = "policy"
    OPERATOR = "operator"
