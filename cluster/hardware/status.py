"""How a campaign stands, for a person: its trials, what it needs next, and the command that gives it that."""

import json
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from cluster.hardware.events import CampaignTrial
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.journal import Journal
from cluster.hardware.lock import Process
from cluster.hardware.states import TERMINAL, Approval, State

RANDOM_TRIALS = 2
"""So many random trials are measured before the first suggestion, as in the paper's hardware runs."""

REASONS = {State.FAILED: "fault", State.REJECTED: "reason"}


class Phase(StrEnum):
    """What a campaign needs next."""

    READY = "ready"
    RUNNING = "running"
    AWAITS_APPROVAL = "awaits approval"
    AWAITS_RESOLUTION = "awaits resolution"
    COMPLETE = "complete"


def phase_of(trials: tuple[CampaignTrial, ...], identity: CampaignIdentity) -> Phase:
    """Tell what a campaign needs next, from its trials alone.

    Args:
        trials: of the campaign, by number.
        identity: of the campaign.

    Returns:
        The phase; it is RUNNING also where the process that ran the trial is dead.
    """
    state = next((trial.state for trial in trials if trial.state not in TERMINAL), None)
    if state is State.UNKNOWN:
        return Phase.AWAITS_RESOLUTION
    if state in (State.GRANTED, State.RUNNING):
        return Phase.RUNNING
    if state is State.CHECKED and identity.approval is Approval.OPERATOR:
        return Phase.AWAITS_APPROVAL
    if state is None and measured_trials(trials) >= planned_trials(identity):
        return Phase.COMPLETE
    return Phase.READY


def planned_trials(identity: CampaignIdentity) -> int:
    """Measured trials after which a campaign is complete."""
    return RANDOM_TRIALS + identity.trials


def measured_trials(trials: tuple[CampaignTrial, ...]) -> int:
    """How many trials have been measured."""
    return sum(trial.state is State.MEASURED for trial in trials)


@dataclass(frozen=True)
class Status:
    """One look at a campaign.

    Attributes:
        name: of the campaign.
        identity: of the campaign.
        phase: what it needs next.
        trials: by number.
        advice: a sentence for the person in charge; "" when nothing is asked of them.
    """

    name: str
    identity: CampaignIdentity
    phase: Phase
    trials: tuple[CampaignTrial, ...]
    advice: str

    @property
    def planned(self) -> int:
        """Measured trials after which the campaign is complete."""
        return planned_trials(self.identity)

    @property
    def measured(self) -> int:
        """Trials measured so far."""
        return measured_trials(self.trials)

    @property
    def best(self) -> float | None:
        """Largest objective measured so far."""
        return max((trial.f for trial in self.trials if trial.f is not None), default=None)

    def as_json(self) -> dict[str, Any]:
        """Plain values by name; of a trial, its controller as numbers of [0, 1]."""
        identity = self.identity
        return {
            "campaign": self.name,
            **{
                name: getattr(identity, name)
                for name in ("robot", "setup", "method", "seed", "model", "pool")
            },
            "approval": str(identity.approval),
            "phase": str(self.phase),
            "measured": self.measured,
            "planned": self.planned,
            "best": self.best,
            "advice": self.advice,
            "trials": [
                {
                    "number": trial.number,
                    "state": str(trial.state),
                    "kind": trial.kind,
                    "x": trial.x.tolist(),
                    "f": trial.f,
                    "y": trial.y,
                }
                for trial in self.trials
            ],
        }


def status(journal: Journal, executor: Process | None) -> Status:
    """Looks at a campaign.

    Args:
        journal: of the campaign.
        executor: the live process that executes it; None when there is none.

    Returns:
        Phase, trials and advice.
    """
    trials = journal.trials()
    now = phase_of(trials, journal.identity)
    return Status(journal.name, journal.identity, now, trials, _advice(journal, trials, now, executor))


def _advice(journal: Journal, trials: tuple[CampaignTrial, ...], now: Phase, executor: Process | None) -> str:
    folder = journal.path.parent
    number = next((trial.number for trial in trials if trial.state not in TERMINAL), None)
    if now is Phase.AWAITS_RESOLUTION:
        return (
            f"trial {number} may have moved the robot when the program died{_on_record(journal)}. When the "
            f"robot stands still and is reset: svaedc hardware resolve {folder} --trial {number} "
            "--outcome measured|failed|aborted --who NAME --note TEXT (--f and --y for measured); "
            "then repeat the start command"
        )
    if now is Phase.AWAITS_APPROVAL:
        return f"trial {number} waits: svaedc hardware approve {folder} --trial {number} --who NAME"
    if trials and trials[-1].state in REASONS:
        last = trials[-1].number
        return f"trial {last} was {_reason(journal, last)}; see to it, then repeat the start command"
    if executor is not None:
        return f"executed by {executor}"
    if now is Phase.RUNNING:
        return (
            f"trial {number} was left behind by a dead process: repeat the start command to have it examined"
        )
    return "" if now is Phase.COMPLETE else "repeat the start command to go on"


def _reason(journal: Journal, number: int) -> str:
    """Why a trial failed or was rejected; the journal's last event may be another trial's amendment."""
    last = next(event for event in reversed(journal.events()) if event.trial == number)
    body = json.loads(last.body)
    return f"{last.new}: {body.get(REASONS[last.new], body.get('note'))}"


def _on_record(journal: Journal) -> str:
    """What the robot's ledger knew of the unknown trial when it was found."""
    found = next(event for event in reversed(journal.events()) if event.new is State.UNKNOWN)
    ledger = json.loads(found.body)["ledger"]
    if ledger["measurement"] is None:
        return " (its ledger: started, never ended)" if ledger["started"] else " (its ledger: never started)"
    return f" (its ledger: ended with f {ledger['measurement']['f']}, y {ledger['measurement']['y']})"
