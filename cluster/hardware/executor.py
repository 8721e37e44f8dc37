"""The one process that carries a campaign out: it holds the robot, the campaign's folder and its journal."""

import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, closing, contextmanager
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from typing import Any
from uuid import uuid4

import numpy as np

from cluster.errors import UserError
from cluster.hardware import campaign, journal
from cluster.hardware.campaign import Campaign
from cluster.hardware.events import utc_now
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.journal import Journal
from cluster.hardware.lock import FolderLock, Process
from cluster.hardware.plan import CampaignPlan
from cluster.hardware.proposals import Proposals, library_versions
from cluster.hardware.record import attachments
from cluster.hardware.robot import residence
from cluster.hardware.states import TERMINAL, Approval, State
from cluster.hardware.status import Status, status
from workers import setups
from workers.hardware import robots
from workers.hardware.gate import Gate
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
            gate = _gate(plan, self._journal, home)
            self._campaign = _campaign(plan, self._journal, gate)
            stack.callback(self._campaign.robot.stop)
            campaign.recover(self._campaign)
            self._home = home
            self._take_over_records()
            self._resources = stack.pop_all()

    def advance(self) -> Status:
        """Goes on until one trial has ended, or until only a person, or time, lets it go on."""
        with residence.robot_errors():
            campaign.advance(self._campaign)
            self._take_over_records()
            return self.status()

    def status(self) -> Status:
        """How the campaign stands."""
        with residence.robot_errors():
            return status(self._journal, Process.current(), self._campaign.gate)

    def _take_over_records(self) -> None:
        """What was recorded at the robot of trials that have ended, whichever process ran them."""
        for trial in self._journal.trials():
            name = campaign.trial_id(self._journal, trial)
            if trial.state in TERMINAL or trial.state is State.UNKNOWN:
                attachments.take_over(self.plan.folder, self._home.trials / name, trial.number)

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
                stack.enter_context(home.hold({"campaign": str(folder), **asdict(Process.current())}))
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


def _gate(plan: CampaignPlan, opened: Journal, home: RobotHome) -> Gate:
    """The gate before the robot; it refuses a folder that was copied, restored or rolled back."""
    known = robots.find(opened.identity.robot)
    gate = Gate(home, residence.limits_of(home, simulated=known.simulated), plan.folder)
    events = opened.events()
    granted = any(event.new is State.GRANTED for event in events)
    gate.require(opened.name, {event.hash for event in events}, granted)
    return gate


def _foresight(
    plan: CampaignPlan, identity: CampaignIdentity
) -> Callable[[int, np.ndarray], Mapping[str, Any]]:
    """What the person who approves is shown; where nobody approves, nothing."""
    if identity.approval is not Approval.OPERATOR:
        return lambda _, __: {}
    return partial(plan.foresight.of, plan.folder, identity.setup, identity.seed)


def _campaign(plan: CampaignPlan, opened: Journal, gate: Gate) -> Campaign:
    identity = opened.identity  # a campaign of before keeps its version of draws
    setup = setups.load(identity.setup)
    robot = robots.find(identity.robot).connect(identity.seed, plan.pace, gate.home, gate.limits)
    return Campaign(
        journal=opened,
        robot=robot,
        gate=replace(gate, robot=robot),
        proposals=Proposals.of(identity, setup, plan.model, plan.candidates),
        dimensions=setup.dimensions,
        process=asdict(Process.current()),
        versions=library_versions(),
        first=plan.first,
        foresee=_foresight(plan, identity),
    )
