"""A hardware campaign: which step comes next, and that each is in the journal before the robot feels it."""

from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

from cluster.hardware.events import CampaignTrial
from cluster.hardware.journal import Journal
from cluster.hardware.states import TERMINAL, State
from cluster.hardware.status import RANDOM_TRIALS, Phase, phase_of
from svaedc.bo.history import History
from workers.hardware.driver import RobotDriver, RobotFault


@runtime_checkable
class Proposer(Protocol):
    """Where controllers come from; a pure function of the campaign's identity and its arguments."""

    def random(self, index: int) -> np.ndarray:
        """The random controller, [D], of one of the first trials."""
        ...

    def suggest(self, history: History, index: int) -> np.ndarray:
        """The controller, [D], of a later trial.

        Args:
            history: what was measured.
            index: of the trial.

        Returns:
            A point of the unit cube.
        """
        ...

    def predict(self, x: np.ndarray) -> float | None:
        """Badness of a controller in [0, 1] as the model expects it; None without a model."""
        ...


@dataclass(frozen=True)
class Campaign:
    """What the steps of a campaign work with.

    Attributes:
        journal: the truth about every trial.
        robot: that is moved.
        proposals: where controllers come from.
        dimensions: D of the robot's setup.
        process: the host, boot and process id that act, kept as evidence.
        versions: of the libraries that compute proposals, kept as evidence.
    """

    journal: Journal
    robot: RobotDriver
    proposals: Proposer
    dimensions: int
    process: Mapping[str, Any]
    versions: Mapping[str, str]


def advance(campaign: Campaign) -> Phase:
    """Goes on until one trial has ended, or until only a person can go on.

    Call it from one thread of the one process that holds the campaign's lock: a trial found granted or
    running here is then one that nobody carries out any more.
    """
    recover(campaign)
    now = _phase(campaign)
    while now is Phase.READY:
        trial = _step(campaign)
        now = _phase(campaign)
        if trial.state in TERMINAL:
            break
    return now


def recover(campaign: Campaign) -> None:
    """Closes what a dead process left behind: `unknown` for a trial that may have moved the robot.

    A trial that was granted and that the robot's own ledger has never seen goes back to approved.
    """
    for trial in campaign.journal.trials():
        if trial.state not in (State.GRANTED, State.RUNNING):
            continue
        motion = campaign.robot.motion(trial_id(campaign.journal, trial))
        never_started = trial.state is State.GRANTED and not motion.started
        new = State.APPROVED if never_started else State.UNKNOWN
        record(
            campaign.journal, trial, new, "recovery", {"ledger": asdict(motion), "found_by": campaign.process}
        )


def history(trials: tuple[CampaignTrial, ...], dimensions: int) -> History:
    """Gather what the method may learn from.

    Args:
        trials: of the campaign, by number.
        dimensions: D of the setup.

    Returns:
        Measured trials with their objective; failed and aborted ones with NaN, only as tried before.
    """
    past = History.empty(dimensions)
    for trial in trials:
        if trial.state is State.MEASURED:
            past = past.append(trial.x, trial.measurement[0])
        elif trial.state in (State.FAILED, State.ABORTED):
            past = past.append(trial.x, float("nan"))
    return past


def objection(x: Float[np.ndarray, " n"], dimensions: int) -> str | None:
    """Say why a controller must not reach the robot.

    Args:
        x: controller, [n].
        dimensions: D of the setup.

    Returns:
        The reason; None when it may.
    """
    if x.shape != (dimensions,):
        return f"the controller must have {dimensions} parameters, got {x.size}"
    if not np.isfinite(x).all():
        return f"every parameter must be finite, got {x[~np.isfinite(x)][0]}"
    if not ((x >= 0) & (x <= 1)).all():
        return f"every parameter must lie in [0, 1], got {x[(x < 0) | (x > 1)][0]}"
    return None


def trial_id(journal: Journal, trial: CampaignTrial) -> str:
    """Name a trial as the robot's ledger knows it.

    Args:
        journal: of the campaign.
        trial: one of its trials.

    Returns:
        Name of the campaign and number of the trial.
    """
    return f"{journal.name}-{trial.number:03d}"


def record(
    journal: Journal, trial: CampaignTrial, new: State, who: str, body: Mapping[str, Any]
) -> CampaignTrial:
    """Moves a trial on from exactly the version that the caller has seen.

    Args:
        journal: of the campaign.
        trial: as the caller has seen it.
        new: the state it enters.
        who: causes it.
        body: what is particular to the transition.

    Returns:
        What the trial became.
    """
    journal.record(trial.number, new, who, body, f"{trial.number}/{trial.version}/{new}")
    return journal.trial(trial.number)


def _phase(campaign: Campaign) -> Phase:
    return phase_of(campaign.journal.trials(), campaign.journal.identity)


def _step(campaign: Campaign) -> CampaignTrial:
    """One transition of the open trial, or the proposal of a new one."""
    trial = next((trial for trial in campaign.journal.trials() if trial.state not in TERMINAL), None)
    return propose(campaign) if trial is None else _STEPS[trial.state](campaign, trial)


def propose(campaign: Campaign) -> CampaignTrial:
    """Stores the next controller, a function of the journal alone: a kill before or after changes nothing."""
    trials = campaign.journal.trials()
    number, past = len(trials), history(trials, campaign.dimensions)
    if len(past) < RANDOM_TRIALS:
        kind, x = "random", campaign.proposals.random(number)
    else:
        kind, x = "suggested", campaign.proposals.suggest(past, number)
    facts = {
        "based_on": [trial.number for trial in trials if trial.state is State.MEASURED],
        "versions": campaign.versions,
    }
    # Setups take controllers rounded to float32; what the journal holds is what moves the robot.
    campaign.journal.propose(number, x.astype(np.float32).astype(np.float64), kind, "campaign", facts)
    return campaign.journal.trial(number)


def _check(campaign: Campaign, trial: CampaignTrial) -> CampaignTrial:
    reason = objection(trial.x, campaign.dimensions)
    if reason is not None:
        return record(campaign.journal, trial, State.REJECTED, "limits", {"reason": reason})
    facts = {"predicted_y": campaign.proposals.predict(trial.x)}
    return record(campaign.journal, trial, State.CHECKED, "limits", facts)


def _approve_by_policy(campaign: Campaign, trial: CampaignTrial) -> CampaignTrial:
    return approve(campaign.journal, trial, "policy: rehearsal")


def approve(journal: Journal, trial: CampaignTrial, who: str) -> CampaignTrial:
    """Lets one trial onto the robot; the approval names the bytes of its controller.

    Args:
        journal: of the campaign.
        trial: as the caller has seen it.
        who: approves.

    Returns:
        What the trial became.
    """
    return record(journal, trial, State.APPROVED, who, {"sha256": trial.sha256})


def _perform(campaign: Campaign, trial: CampaignTrial) -> CampaignTrial:
    """Moves the robot once; what the driver declares a fault is failed, all else that breaks is unknown."""
    journal = campaign.journal
    granted = record(journal, trial, State.GRANTED, "executor", campaign.process)
    running = record(journal, granted, State.RUNNING, "executor", campaign.process)
    try:
        measured = campaign.robot.run(trial_id(journal, trial), running.x)
    except RobotFault as fault:
        return record(journal, running, State.FAILED, "executor", {"fault": str(fault)})
    return record(journal, running, State.MEASURED, "executor", asdict(measured))


_STEPS: Mapping[State, Callable[[Campaign, CampaignTrial], CampaignTrial]] = {
    State.PROPOSED: _check,
    State.CHECKED: _approve_by_policy,
    State.APPROVED: _perform,
}
