"""What a campaign needs next, decided from its trials alone."""

from enum import StrEnum

from cluster.events import Trial
from cluster.states import TERMINAL, State


class Approval(StrEnum):
    """Who lets a checked controller onto the robot."""

    POLICY = "policy"
    OPERATOR = "operator"


class Standing(StrEnum):
    """What a campaign needs next."""

    READY = "ready"
    RUNNING = "running"
    AWAITS_APPROVAL = "awaits approval"
    AWAITS_RESOLUTION = "awaits resolution"
    COMPLETE = "complete"


def standing(trials: tuple[Trial, ...], planned: int, approval: Approval) -> Standing:
    """What a campaign needs next, as a function of its trials alone.

    Args:
        trials: of the campaign, by number.
        planned: measured trials after which it is complete.
        approval: who approves.
    """
    state = next((trial.state for trial in trials if trial.state not in TERMINAL), None)
    if state is State.UNKNOWN:
        return Standing.AWAITS_RESOLUTION
    if state in (State.GRANTED, State.RUNNING):
        return Standing.RUNNING
    if state is State.CHECKED and approval is Approval.OPERATOR:
        return Standing.AWAITS_APPROVAL
    if state is None and sum(trial.state is State.MEASURED for trial in trials) >= planned:
        return Standing.COMPLETE
    return Standing.READY
