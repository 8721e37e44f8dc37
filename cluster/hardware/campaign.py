"""A hardware campaign: which step comes next, and that each is in the journal before the robot feels it."""

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from cluster.hardware.events import CampaignTrial, utc_now
from cluster.hardware.journal import Journal
from cluster.hardware.record.first_trials import FirstTrial
from cluster.hardware.robot.approvals import lapse_of
from cluster.hardware.robot.gateway import CampaignGate, Proposer
from cluster.hardware.states import IMPORTED, TERMINAL, State
from cluster.hardware.status import RANDOM_TRIALS, Phase, phase_at, phase_of
from svaedc.bo.history import History
from workers.hardware.driver import RobotBroke, RobotDriver, RobotFault, RobotStopped
from workers.user_code import describe


def _nothing(trial: int, x: np.ndarray) -> Mapping[str, Any]:  # noqa: ARG001
    """Nobody has to be shown anything."""
    return {}


@dataclass(frozen=True)
class Campaign:
    """What the steps of a campaign work with.

    Attributes:
        journal: the truth about every trial.
        robot: that is moved.
        gate: stands before it.
        proposals: where controllers come from.
        dimensions: D of the robot's setup.
        process: the host, boot and process id that act, kept as evidence.
        versions: of the libraries that compute proposals, kept as evidence.
        first: trials that another campaign measured; they take the place of the first random ones.
        foresee: what a person is shown of a trial, by its number and controller, before they approve it.
    """

    journal: Journal
    robot: RobotDriver
    gate: CampaignGate
    proposals: Proposer
    dimensions: int
    process: Mapping[str, Any]
    versions: Mapping[str, str]
    first: tuple[FirstTrial, ...] = ()
    foresee: Callable[[int, np.ndarray], Mapping[str, Any]] = _nothing


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
        motion = campaign.gate.motion(trial_id(campaign.journal, trial))
        never_started = trial.state is State.GRANTED and not motion.started and motion.certain
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
        Measured trials with their objective; failed, aborted and rejected ones with NaN, as never to be tried
        again.
    """
    past = History.empty(dimensions)
    for trial in trials:
        if trial.state is State.MEASURED:
            past = past.append(trial.x, trial.measurement[0])
        elif trial.state in (State.FAILED, State.ABORTED, State.REJECTED):
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
    trials = campaign.journal.trials()
    return phase_at(campaign.gate, phase_of(trials, campaign.journal.identity), trials)


def _step(campaign: Campaign) -> CampaignTrial:
    """One transition of the open trial, or the proposal of a new one."""
    trial = next((trial for trial in campaign.journal.trials() if trial.state not in TERMINAL), None)
    return propose(campaign) if trial is None else _STEPS[trial.state](campaign, trial)


def propose(campaign: Campaign) -> CampaignTrial:
    """Stores the next controller, a function of the journal alone: a kill before or after changes nothing."""
    trials = campaign.journal.trials()
    number, past = len(trials), history(trials, campaign.dimensions)
    if number < len(campaign.first):
        return _propose_again(campaign, number, campaign.first[number])
    if len(past) < RANDOM_TRIALS:
        kind, x = "random", campaign.proposals.random(past, number)
    else:
        kind, x = "suggested", campaign.proposals.suggest(past, number)
    facts = {
        "based_on": [trial.number for trial in trials if trial.state is State.MEASURED],
        "versions": campaign.versions,
    }
    # Setups take controllers rounded to float32; what the journal holds is what moves the robot.
    campaign.journal.propose(number, x.astype(np.float32).astype(np.float64), kind, "campaign", facts)
    return campaign.journal.trial(number)


def _propose_again(campaign: Campaign, number: int, shared: FirstTrial) -> CampaignTrial:
    """A controller that another campaign has tried already, with what it measured."""
    facts = {"campaign": shared.campaign, "trial": shared.number, "f": shared.f, "y": shared.y}
    campaign.journal.propose(number, shared.x, IMPORTED, "campaign", {IMPORTED: facts})
    return campaign.journal.trial(number)


def _take_over(campaign: Campaign, trial: CampaignTrial) -> CampaignTrial:
    """Nothing moves: the other campaign's measurement counts here too."""
    facts = json.loads(campaign.journal.last_event(trial.number).body)[IMPORTED]
    return record(campaign.journal, trial, State.MEASURED, f"campaign: {facts['campaign']}", facts)


def _check(campaign: Campaign, trial: CampaignTrial) -> CampaignTrial:
    if trial.kind == IMPORTED:
        return _take_over(campaign, trial)
    reason = objection(trial.x, campaign.dimensions)
    if reason is not None:
        return record(campaign.journal, trial, State.REJECTED, "limits", {"reason": reason})
    plan = campaign.gate.plan(trial_id(campaign.journal, trial), trial.x)
    if plan.get("objection"):
        return record(campaign.journal, trial, State.REJECTED, "limits", {"reason": plan["objection"]})
    facts = {
        "predicted_y": campaign.proposals.predict(trial.x),
        "plan": dict(plan),
        **campaign.foresee(trial.number, trial.x),
    }
    return record(campaign.journal, trial, State.CHECKED, "limits", facts)


def _approve_by_policy(campaign: Campaign, trial: CampaignTrial) -> CampaignTrial:
    return approve(campaign.journal, trial, "policy: rehearsal", {})


def approve(journal: Journal, trial: CampaignTrial, who: str, bounds: Mapping[str, Any]) -> CampaignTrial:
    """Lets one trial onto the robot; the approval names the bytes of its controller.

    Args:
        journal: of the campaign.
        trial: as the caller has seen it.
        who: approves.
        bounds: what else the approval is bound to: `limits`, a SHA-256, and `until`, a moment in UTC.

    Returns:
        What the trial became.
    """
    return record(journal, trial, State.APPROVED, who, {"sha256": trial.sha256, **bounds})


def _perform(campaign: Campaign, trial: CampaignTrial) -> CampaignTrial:
    """Moves the robot once; what the driver declares a fault is failed, all else that breaks is unknown."""
    journal, name = campaign.journal, trial_id(campaign.journal, trial)
    approved = journal.last_event(trial.number)
    lapse = lapse_of(approved, campaign.gate.approval(), utc_now())
    if lapse:
        return record(journal, trial, State.CHECKED, "executor", {"reason": lapse})
    granted = record(journal, trial, State.GRANTED, "executor", campaign.process)
    campaign.gate.grant(journal.name, name, journal.last_event(trial.number).hash)
    running = record(journal, granted, State.RUNNING, "executor", campaign.process)
    try:
        measured = campaign.robot.run(name, running.x)
    except RobotStopped as stopped:
        return record(journal, running, State.ABORTED, "executor", {"fault": str(stopped)})
    except RobotBroke as broke:
        return _leave_open(campaign, running, str(broke))
    except RobotFault as fault:
        return record(journal, running, State.FAILED, "executor", {"fault": str(fault)})
    except Exception as error:  # noqa: BLE001 - a driver may raise anything, and the robot may have moved
        return _leave_open(campaign, running, f"the driver failed: {describe(error)}")
    return record(journal, running, State.MEASURED, "executor", asdict(measured))


def _leave_open(campaign: Campaign, running: CampaignTrial, cause: str) -> CampaignTrial:
    """Nobody knows what the robot did: a person will say."""
    motion = campaign.gate.motion(trial_id(campaign.journal, running))
    facts = {"ledger": asdict(motion), "found_by": campaign.process, "cause": cause}
    return record(campaign.journal, running, State.UNKNOWN, "executor", facts)


_STEPS: Mapping[State, Callable[[Campaign, CampaignTrial], CampaignTrial]] = {
    State.PROPOSED: _check,
    State.CHECKED: _approve_by_policy,
    State.APPROVED: _perform,
}
