"""The one process that carries a campaign out: it holds the robot, the campaign's folder and its journal."""

import socket
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
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
from cluster.hardware.robot import residence
from cluster.hardware.states import State
from cluster.hardware.status import Status, status
from workers import setups
from workers.hardware import robots
from workers.hardware.gate import Gate, holder_facts
from workers.host.home import RobotHeld, RobotHome

PATIENCE_SECONDS = 30.0
"""A process that was killed a moment ago may still be on its way out, and holds its locks until then."""


class Executor:
    """Carries one campaign out; holds its robot and its folder until `close` or the death of the process.

    Args:
        plan: what to carry out; a folder that holds a campaign already must hold this one.

    Raises:
        FolderTaken: when another live process executes the folder's campaign.
        IdentityMismatch: when the folder holds another campaign.
        JournalError: when the journal cannot be used, or is damaged.
        UserError: when the model is missing or another's, or the robot must not serve this folder: another
            campaign holds it, or the folder is a copy.
    """

    def __init__(self, plan: CampaignPlan) -> None:
        self.plan = plan
        with ExitStack() as stack, residence.robot_errors():
            _make(plan.folder)
            stack.enter_context(FolderLock(plan.folder, PATIENCE_SECONDS))
            home = residence.enter(plan.folder, plan.identity.robot, plan.home)
            stack.enter_context(_hold_robot(home, plan.folder))
            self._journal = stack.enter_context(closing(_journal(plan)))
            self._campaign, self._gate = _campaign(plan, self._journal, home)
            stack.callback(self._campaign.robot.stop)
            _require_own(self._gate, self._journal)
            campaign.recover(self._campaign)
            self._resources = stack.pop_all()

    def advance(self) -> Status:
        """Goes on until one trial has ended, or until only a person, or time, lets it go on."""
        with residence.robot_errors():
            campaign.advance(self._campaign)
            return self.status()

    def status(self) -> Status:
        """How the campaign stands."""
        with residence.robot_errors():
            return status(self._journal, Process.current(), self._gate)

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


@contextmanager
def _hold_robot(home: RobotHome, folder: Path) -> Iterator[None]:
    """The robot, for this process alone."""
    deadline = time.monotonic() + PATIENCE_SECONDS
    while True:
        with ExitStack() as stack:
            try:
                stack.enter_context(home.hold(holder_facts(folder, socket.gethostname())))
            except RobotHeld:
                if time.monotonic() >= deadline:
                    raise
            else:
                yield
                return
        time.sleep(0.1)


def _journal(plan: CampaignPlan) -> Journal:
    path = plan.folder / journal.FILE
    journal.create(path, f"{plan.identity.robot}-{uuid4().hex[:8]}", plan.identity)
    opened = Journal(path, utc_now)
    opened.identity.require(plan.identity, str(path))
    return opened


def _campaign(plan: CampaignPlan, opened: Journal, home: RobotHome) -> tuple[Campaign, Gate]:
    identity = opened.identity  # a campaign of before keeps its version of draws
    setup, known = setups.load(identity.setup), robots.find(identity.robot)
    limits = residence.limits_of(home, simulated=known.simulated)
    robot = known.connect(identity.seed, plan.pace, home, limits)
    gate = Gate(home, limits, plan.folder, robot)
    return (
        Campaign(
            journal=opened,
            robot=robot,
            gate=gate,
            proposals=Proposals.of(identity, setup, plan.model, plan.candidates),
            dimensions=setup.dimensions,
            process=asdict(Process.current()),
            versions=library_versions(),
        ),
        gate,
    )


def _require_own(gate: Gate, opened: Journal) -> None:
    """Refuse a folder that was copied, restored or rolled back."""
    events = opened.events()
    granted = any(event.new is State.GRANTED for event in events)
    gate.require(opened.name, {event.hash for event in events}, granted)
