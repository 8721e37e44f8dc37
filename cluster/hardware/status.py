"""How a campaign stands, for a person: its trials, what it needs next, and the command that gives it that."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from enum import StrEnum
from pathlib import Path
from typing import Any, Protocol, runtime_checkable

from cluster.hardware.events import CampaignTrial, moment_in_words, utc_now
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.journal import Journal
from cluster.hardware.lock import Process
from cluster.hardware.states import TERMINAL, Approval, State

RANDOM_TRIALS = 2
"""So many random trials are measured before the first suggestion, as in the paper's hardware runs."""

REASONS = {State.FAILED: "fault", State.REJECTED: "reason", State.ABORTED: "fault"}


class Phase(StrEnum):
    """What a campaign needs next."""

    READY = "ready"
    RUNNING = "running"
    AWAITS_APPROVAL = "awaits approval"
    AWAITS_RESOLUTION = "awaits resolution"
    STOPPED = "stopped"
    RESTS = "rests"
    COMPLETE = "complete"


@runtime_checkable
class RobotGate(Protocol):
    """What its robot says of a campaign; see `workers.hardware.gate.Gate`."""

    @property
    def stopped(self) -> str:
        """Why the robot is stopped; "" when it is not."""
        ...

    def rest_seconds(self, now: datetime) -> float:
        """How long the robot must rest before its next trial."""
        ...


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
        folder: of the campaign.
        motion: what the trial that waits for approval will do, as its check found it: `plan`, `predicted_y`.
    """

    name: str
    identity: CampaignIdentity
    phase: Phase
    trials: tuple[CampaignTrial, ...]
    advice: str
    folder: Path
    motion: Mapping[str, Any] = field(default_factory=dict)

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
            "motion": dict(self.motion),
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


def status(journal: Journal, executor: Process | None, gate: RobotGate | None = None) -> Status:
    """Looks at a campaign.

    Args:
        journal: of the campaign.
        executor: the live process that executes it; None when there is none.
        gate: before its robot; None where that is not known.

    Returns:
        Phase, trials and advice.
    """
    trials = journal.trials()
    now = phase_of(trials, journal.identity)
    if gate is not None:
        now = phase_at(gate, now, trials)
    advice = _advice(journal, trials, now, executor, gate)
    motion = _checked_motion(journal, trials) if now is Phase.AWAITS_APPROVAL else {}
    return Status(journal.name, journal.identity, now, trials, advice, journal.path.parent, motion)


def _checked_motion(journal: Journal, trials: Sequence[CampaignTrial]) -> Mapping[str, Any]:
    """What the check found of the trial that waits; an approval that was withdrawn may have come since."""
    number = next(trial.number for trial in trials if trial.state is State.CHECKED)
    bodies = [json.loads(event.body) for event in journal.events() if event.trial == number]
    return next((body for body in reversed(bodies) if "plan" in body), {})


def phase_at(gate: RobotGate, phase: Phase, trials: Sequence[CampaignTrial]) -> Phase:
    """Tell what a campaign needs next where its robot has a say in it.

    Args:
        gate: before its robot.
        phase: as its trials have it.
        trials: of the campaign, by number.

    Returns:
        STOPPED or RESTS where the next step would move the robot, and it is stopped or must rest.
    """
    if phase is Phase.READY and any(trial.state is State.APPROVED for trial in trials):
        if gate.stopped:
            return Phase.STOPPED
        if gate.rest_seconds(utc_now()) > 0:
            return Phase.RESTS
    return phase


def _advice(
    journal: Journal,
    trials: tuple[CampaignTrial, ...],
    now: Phase,
    executor: Process | None,
    gate: RobotGate | None,
) -> str:
    folder, robot = journal.path.parent, journal.identity.robot
    number = next((trial.number for trial in trials if trial.state not in TERMINAL), None)
    if now is Phase.AWAITS_RESOLUTION:
        return (
            f"trial {number} may have moved the robot{_on_record(journal)}. When the "
            f"robot stands still and is reset: svaedc hardware resolve {folder} --trial {number} "
            "--outcome measured|failed|aborted --who NAME --note TEXT (--f and --y for measured); "
            "then repeat the start command"
        )
    if gate is not None and (now is Phase.STOPPED or gate.stopped):
        return (
            f"the robot was {gate.stopped}. When it stands still and is reset: svaedc hardware clear {robot} "
            "--who NAME --note TEXT; then repeat the start command"
        )
    if gate is not None and now is Phase.RESTS:
        return f"the robot rests {gate.rest_seconds(utc_now()):.0f} s more, as its limits say"
    if now is Phase.AWAITS_APPROVAL:
        since = _since(journal, trials[-1].number)
        return (
            f"trial {number} waits for a person since {since}: svaedc hardware approve {folder} "
            f"--trial {number} --who NAME (or reject, with --note TEXT)"
        )
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
    last = journal.last_event(number)
    body = json.loads(last.body)
    return f"{last.new}: {body.get(REASONS[last.new], body.get('note'))}"


def _since(journal: Journal, number: int) -> str:
    """When a trial came to where it stands."""
    last = journal.last_event(number)
    return f"{moment_in_words(last.at)} UTC"


def _on_record(journal: Journal) -> str:
    """What the robot's ledger knew of the unknown trial when it was found."""
    found = next(event for event in reversed(journal.events()) if event.new is State.UNKNOWN)
    body = json.loads(found.body)
    cause = f": {body['cause']}" if body.get("cause") else " when the program died"
    return f"{cause} ({_ledger_says(body['ledger'])})"


def _ledger_says(ledger: Mapping[str, Any]) -> str:
    if ledger["measurement"] is not None:
        return f"its ledger: ended with f {ledger['measurement']['f']}, y {ledger['measurement']['y']}"
    if ledger["started"]:
        return "its ledger: started, never ended"
    return "its ledger: never started" if ledger.get("certain", True) else "its ledger was cut off"
