"""What a person does to a campaign in a folder: look, approve, resolve, export."""

from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict
from pathlib import Path

from cluster.errors import UsageError
from cluster.hardware import campaign, journal, lock
from cluster.hardware.events import CampaignTrial, canonical, utc_now
from cluster.hardware.journal import Journal
from cluster.hardware.lock import FolderLock, Process
from cluster.hardware.states import State
from cluster.hardware.status import Status
from cluster.hardware.status import status as look
from workers.hardware import ledger
from workers.hardware.ledger import MotionLedger

OUTCOMES = (State.MEASURED, State.FAILED, State.ABORTED)


def status(folder: Path) -> Status:
    """How the campaign in a folder stands.

    Raises:
        JournalError: when there is none, or its journal is damaged.
    """
    with _open(folder) as opened:
        return look(opened, lock.holder(folder))


def approve(folder: Path, trial: int, who: str) -> CampaignTrial:
    """Lets a checked trial onto the robot.

    Args:
        folder: of the campaign.
        trial: its number.
        who: approves; recorded for good.

    Returns:
        The approved trial.

    Raises:
        IllegalTransition: when the trial does not wait for approval.
    """
    with _open(folder) as opened:
        return campaign.approve(opened, opened.trial(trial), _require_name(who))


def resolve(
    folder: Path, trial: int, outcome: str, who: str, note: str, f: float | None, y: float | None
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

    Returns:
        The trial with its outcome.

    Raises:
        UsageError: when an argument is missing, too much, or out of its range.
        IllegalTransition: when the trial is neither unknown nor, for an amendment, measured.
        FolderTaken: when the trial is running at this moment.
    """
    new, body = _resolution(outcome, note, f, y)
    close_abandoned(folder, patience=0.0)
    with _open(folder) as opened:
        return campaign.record(opened, opened.trial(trial), new, _require_name(who), body)


def close_abandoned(folder: Path, patience: float) -> None:
    """Makes a running trial unknown when the process that ran it is dead.

    Args:
        folder: of the campaign.
        patience: seconds that process has to die.

    Raises:
        FolderTaken: when it is alive.
    """
    with _open(folder) as opened:
        running = [trial for trial in opened.trials() if trial.state is State.RUNNING]
        if running:
            with FolderLock(folder, patience):
                for trial in running:
                    motion = MotionLedger(folder / ledger.FILE).motion(campaign.trial_id(opened, trial))
                    facts = {"ledger": asdict(motion), "found_by": asdict(Process.current())}
                    campaign.record(opened, trial, State.UNKNOWN, "recovery", facts)


def export(folder: Path) -> Iterator[str]:
    """The journal as JSON lines: the campaign first, then every event, oldest first."""
    with _open(folder) as opened:
        yield canonical({"campaign": opened.name, **opened.identity.facts()})
        for event in opened.events():
            yield canonical(asdict(event))


@contextmanager
def _open(folder: Path) -> Iterator[Journal]:
    with closing(Journal(folder / journal.FILE, utc_now)) as opened:
        yield opened


def _require_name(who: str) -> str:
    if not who.strip():
        raise UsageError("who must name a person, got nothing; give --who NAME")
    return f"operator: {who.strip()}"


def _resolution(
    outcome: str, note: str, f: float | None, y: float | None
) -> tuple[State, dict[str, str | float | None]]:
    if outcome not in OUTCOMES:
        raise UsageError(f"outcome must be one of {', '.join(OUTCOMES)}, got {outcome!r}")
    if not note.strip():
        raise UsageError("a resolution needs a note that says what was seen, got nothing; give --note TEXT")
    if outcome != State.MEASURED:
        if f is not None or y is not None:
            raise UsageError(f"f and y belong to the outcome measured, got f {f} and y {y} for {outcome}")
        return State(outcome), {"note": note}
    if f is None or not abs(f) < float("inf"):
        raise UsageError(f"a measured trial needs a finite objective, got {f}; give --f NUMBER")
    if y is None or not 0.0 <= y <= 1.0:
        raise UsageError(f"a measured trial needs a badness in [0, 1], got {y}; give --y NUMBER")
    return State.MEASURED, {"f": f, "y": y, "note": note}
