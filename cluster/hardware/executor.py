"""The one process that carries a campaign out: it holds the folder's lock, the journal and the robot."""

from contextlib import ExitStack, closing
from dataclasses import asdict
from pathlib import Path
from uuid import uuid4

from cluster.errors import UserError
from cluster.hardware import campaign, journal
from cluster.hardware.campaign import Campaign
from cluster.hardware.events import utc_now
from cluster.hardware.journal import Journal
from cluster.hardware.lock import FolderLock, Process
from cluster.hardware.plan import CampaignPlan
from cluster.hardware.proposals import Proposals, library_versions
from cluster.hardware.status import Status, status
from workers import setups
from workers.hardware import robots

PATIENCE_SECONDS = 30.0
"""A process that was killed a moment ago may still be on its way out, and holds its lock until then."""


class Executor:
    """Carries one campaign out; holds its folder until `close` or the death of the process.

    Args:
        plan: what to carry out; a folder that holds a campaign already must hold this one.

    Raises:
        FolderTaken: when another live process executes the folder's campaign.
        IdentityMismatch: when the folder holds another campaign.
        JournalError: when the journal cannot be used, or is damaged.
        UserError: when the model is missing or another's.
    """

    def __init__(self, plan: CampaignPlan) -> None:
        self.plan = plan
        with ExitStack() as stack:
            _make(plan.folder)
            stack.enter_context(FolderLock(plan.folder, PATIENCE_SECONDS))
            self._journal = stack.enter_context(closing(_journal(plan)))
            self._campaign = _campaign(plan, self._journal)
            stack.callback(self._campaign.robot.stop)
            campaign.recover(self._campaign)
            self._resources = stack.pop_all()

    def advance(self) -> Status:
        """Goes on until one trial has ended, or until only a person can go on."""
        campaign.advance(self._campaign)
        return self.status()

    def status(self) -> Status:
        """How the campaign stands."""
        return status(self._journal, Process.current())

    def close(self) -> None:
        """Stops the robot and lets another process execute the campaign."""
        self._resources.close()


def _make(folder: Path) -> None:
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise UserError(
            f"cannot make the folder {folder}: {error.strerror}; choose a writable one"
        ) from error


def _journal(plan: CampaignPlan) -> Journal:
    path = plan.folder / journal.FILE
    journal.create(path, f"{plan.identity.robot}-{uuid4().hex[:8]}", plan.identity)
    opened = Journal(path, utc_now)
    opened.identity.require(plan.identity, str(path))
    return opened


def _campaign(plan: CampaignPlan, opened: Journal) -> Campaign:
    identity = opened.identity  # a campaign of before keeps its version of draws
    setup = setups.load(identity.setup)
    return Campaign(
        journal=opened,
        robot=robots.find(identity.robot).connect(identity.seed, plan.pace, plan.folder),
        proposals=Proposals.of(identity, setup, plan.model, plan.candidates),
        dimensions=setup.dimensions,
        process=asdict(Process.current()),
        versions=library_versions(),
    )
