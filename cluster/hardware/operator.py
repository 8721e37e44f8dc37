"""What a person does to a campaign in a folder: look, approve, reject, resolve, amend, attach."""

from dataclasses import asdict
from datetime import timedelta
from pathlib import Path

from cluster.errors import UsageError, UserError
from cluster.hardware import campaign, lock
from cluster.hardware.events import CampaignTrial, utc_now
from cluster.hardware.journal import Journal
from cluster.hardware.lock import FolderLock, Process
from cluster.hardware.record import attachments, opening
from cluster.hardware.record.attachments import Attachment
from cluster.hardware.record.resolution import require_possible, resolution_of
from cluster.hardware.robot import residence
from cluster.hardware.states import State
from cluster.hardware.status import Status
from cluster.hardware.status import status as look
from workers.hardware import robots
from workers.hardware.gate import Gate

VALID_MINUTES = 60.0
"""An approval holds so long, unless a person says otherwise."""


class Outdated(UserError):  # noqa: N818 - names the state of what was seen
    """The trial is no longer what the person saw when they decided."""


def status(folder: Path) -> Status:
    """How the campaign in a folder stands; nothing is written, so that a copy on read-only media will do.

    Raises:
        JournalError: when there is none, or its journal is damaged.
    """
    with opening.to_read(folder) as opened:
        return status_of(folder, opened)


def status_of(folder: Path, opened: Journal) -> Status:
    """How a campaign stands whose journal is open.

    Args:
        folder: of the campaign.
        opened: its journal.

    Returns:
        The same as `status`.
    """
    with residence.robot_errors():
        return look(opened, lock.holder(folder), _gate(folder, opened))


def approve(
    folder: Path, trial: int, who: str, minutes: float = VALID_MINUTES, seen: int | None = None
) -> CampaignTrial:
    """Lets a checked trial onto the robot; bound to the controller, to the robot's limits, and for a while.

    Args:
        folder: of the campaign.
        trial: its number.
        who: approves; recorded for good.
        minutes: that the approval holds.
        seen: version of the trial that the person looked at; None for the present one.

    Returns:
        The approved trial.

    Raises:
        Outdated: the trial has changed since it was looked at.
        UsageError: nobody is named, or the time is none.
        IllegalTransition: when the trial does not wait for approval.
    """
    if not 0 < minutes < float("inf"):
        raise UsageError(f"an approval must hold for some minutes, got {minutes}; give --minutes NUMBER")
    with opening.to_write(folder) as opened, residence.robot_errors():
        until = utc_now() + timedelta(minutes=minutes)
        bounds = {"limits": _gate(folder, opened).approval()["limits"], "until": until.isoformat()}
        return campaign.approve(opened, _trial_as_seen(opened, trial, seen), _require_name(who), bounds)


def withdraw(folder: Path, trial: int, who: str, seen: int | None = None) -> CampaignTrial:
    """Takes an approval back, as long as the trial was not granted.

    Args:
        folder: of the campaign.
        trial: its number.
        who: decides; recorded for good.
        seen: version of the trial that the person looked at; None for the present one.

    Returns:
        The trial, which waits for approval again.

    Raises:
        Outdated: the trial has changed since it was looked at.
        IllegalTransition: when the trial is not approved, or was granted already.
    """
    with opening.to_write(folder) as opened:
        facts = {"reason": "the approval was withdrawn"}
        now = _trial_as_seen(opened, trial, seen)
        return campaign.record(opened, now, State.CHECKED, _require_name(who), facts)


def reject(folder: Path, trial: int, who: str, note: str, seen: int | None = None) -> CampaignTrial:
    """Keeps a trial off the robot; neither its controller nor one near it is ever suggested again.

    Args:
        folder: of the campaign.
        trial: its number.
        who: decides; recorded for good.
        note: why; recorded for good.
        seen: version of the trial that the person looked at; None for the present one.

    Returns:
        The rejected trial.

    Raises:
        Outdated: the trial has changed since it was looked at.
        UsageError: nobody is named, or nothing is noted.
        IllegalTransition: when the trial was granted already, or has ended.
    """
    if not note.strip():
        raise UsageError("a rejection needs a note that says why, got nothing; give --note TEXT")
    with opening.to_write(folder) as opened:
        facts = {"reason": note.strip()}
        now = _trial_as_seen(opened, trial, seen)
        return campaign.record(opened, now, State.REJECTED, _require_name(who), facts)


def adopt(folder: Path, who: str, home: Path | None) -> None:
    """Vouches for a campaign that moved the robot under another home.

    Args:
        folder: of the campaign.
        who: vouches; recorded for good.
        home: of the robot from now on; None for the usual one.

    Raises:
        UserError: when the robot's home cannot be written.
    """
    name = _require_name(who)
    with opening.to_write(folder) as opened, residence.robot_errors():
        found = residence.enter(folder, opened.identity.robot, home)
        Gate(found, residence.limits_of(found, simulated=True), folder).adopt(opened.name, name)


def resolve(
    folder: Path,
    trial: int,
    outcome: str,
    who: str,
    note: str,
    f: float | None,
    y: float | None,
    confirmed: float | None = None,
    seen: int | None = None,
) -> CampaignTrial:
    """Says what became of an unknown trial, or amends a measured one; the old value stays in the events.

    Args:
        folder: of the campaign.
        trial: its number.
        outcome: "measured", "failed" or "aborted".
        who: decides, having seen the robot stand still and reset; recorded for good.
        note: why; recorded for good.
        f: objective of a measured trial; None otherwise.
        y: badness in [0, 1] of a measured trial; None otherwise.
        confirmed: the objective once more, where it lies outside what the setup says is possible.
        seen: version of the trial that the person looked at; None for the present one.

    Returns:
        The trial with its outcome.

    Raises:
        Outdated: the trial has changed since it was looked at.
        UsageError: when an argument is missing, too much, or out of its range.
        IllegalTransition: when the trial is neither unknown nor, for an amendment, measured.
        FolderTaken: when the trial is running at this moment.
    """
    new, body = resolution_of(outcome, note, f, y)
    close_abandoned(folder, patience=0.0)
    with opening.to_write(folder) as opened:
        require_possible(opened.identity.setup, f, confirmed)
        return campaign.record(opened, _trial_as_seen(opened, trial, seen), new, _require_name(who), body)


def amend(
    folder: Path,
    trial: int,
    who: str,
    note: str,
    f: float,
    y: float,
    confirmed: float | None = None,
    seen: int | None = None,
) -> CampaignTrial:
    """Corrects what a trial measured; the old value stays in the events.

    Args:
        folder: of the campaign.
        trial: its number.
        who: decides; recorded for good.
        note: why; recorded for good.
        f: objective.
        y: badness in [0, 1].
        confirmed: the objective once more, where it lies outside what the setup says is possible.
        seen: version of the trial that the person looked at; None for the present one.

    Returns:
        The trial as amended.

    Raises:
        Outdated: the trial has changed since it was looked at.
        UsageError: when an argument is missing or out of its range, or the trial was not measured.
    """
    with opening.to_read(folder) as opened:
        state = opened.trial(trial).state
    if state is not State.MEASURED:
        raise UsageError(
            f"only a measured trial can be amended, trial {trial} is {state}; an unknown one is resolved"
        )
    return resolve(folder, trial, State.MEASURED, who, note, f, y, confirmed, seen)


def close_abandoned(folder: Path, patience: float) -> None:
    """Makes a running trial unknown when the process that ran it is dead.

    Args:
        folder: of the campaign.
        patience: seconds that process has to die.

    Raises:
        FolderTaken: when it is alive.
    """
    with opening.to_write(folder) as opened, residence.robot_errors():
        running = [trial for trial in opened.trials() if trial.state is State.RUNNING]
        if running:
            with FolderLock(folder, patience):
                for trial in running:
                    motion = _gate(folder, opened).motion(campaign.trial_id(opened, trial))
                    facts = {"ledger": asdict(motion), "found_by": asdict(Process.current())}
                    campaign.record(opened, trial, State.UNKNOWN, "recovery", facts)


def attach(folder: Path, trial: int, path: Path, who: str, note: str) -> Attachment:
    """Keeps a copy of a file, such as a video or a log, with a trial.

    Args:
        folder: of the campaign.
        trial: its number.
        path: of the file.
        who: attaches it; recorded for good.
        note: what it shows; recorded for good.

    Returns:
        The attachment.

    Raises:
        UsageError: nobody is named, or there is no such file.
        JournalError: there is no such trial.
        UserError: the file cannot be kept.
    """
    name = _require_name(who)
    with opening.to_read(folder) as opened:
        opened.trial(trial)
    return attachments.attach(folder, trial, path, name, note.strip())


def _gate(folder: Path, opened: Journal) -> Gate:
    """What the robot's home says, for somebody who only looks."""
    home = residence.home_of_campaign(folder, opened.identity.robot)
    try:
        simulated = robots.find(opened.identity.robot).simulated
    except LookupError:  # its module is not here, and its home may be
        simulated = True
    return Gate(home, residence.limits_of(home, simulated=simulated), folder)


def _trial_as_seen(opened: Journal, number: int, seen: int | None) -> CampaignTrial:
    """A trial, if it still is what a person saw; that it stays so until the event is the journal's matter."""
    trial = opened.trial(number)
    if seen is not None and trial.version != seen:
        last = opened.last_event(number)
        raise Outdated(
            f"trial {number} has changed since this was looked at: it is {trial.state} now, by {last.who}; "
            "nothing was done. Look again, then decide"
        )
    return trial


def _require_name(who: str) -> str:
    if not who.strip():
        raise UsageError("who must name a person, got nothing; give --who NAME")
    return f"operator: {who.strip()}"
