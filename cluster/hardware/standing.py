"""What a campaign needs next, decided from its trials alone."""

from enum import StrEnum

from cluster.hardware.events import Trial
from cluster.hardware.identity import Approval, Identity
from cluster.hardware.states import TERMINAL, State

RANDOM_TRIALS = 2
"""Measured before the first suggestion, as in the paper's hardware runs."""


class Standing(StrEnum):
    """What a campaign needs next."""

    READY = "ready"
    RUNNING = "running"
    AWAITS_APPROVAL = "awaits approval"
    AWAITS_RESOLUTION = "awaits resolution"
    COMPLETE = "complete"


def standing(trials: tuple[Trial, ...], identity: Identity) -> Standing:
    """What a campaign needs next, as a function of its trials alone.

    Args:
        trials: of the campaign, by number.
        identity: of the campaign.
    """
    state = next((trial.state for trial in trials if trial.state not in TERMINAL), None)
    if state is State.UNKNOWN:
        return Standing.AWAITS_RESOLUTION
    if state in (State.GRANTED, State.RUNNING):
        return Standing.RUNNING
    if state is State.CHECKED and identity.approval is Approval.OPERATOR:
        return Standing.AWAITS_APPROVAL
    if state is None and measured(trials) >= planned(identity):
        return Standing.COMPLETE
    return Standing.READY


def planned(identity: Identity) -> int:
    """Measured trials after which a campaign is complete."""
    return RANDOM_TRIALS + identity.trials


def measured(trials: tuple[Trial, ...]) -> int:
    """How many trials have been measured."""
    return sum(trial.state is State.MEASURED for trial in trials)
