"""`svaedc hardware start`: one serialized Ray actor at the robot, asked for one trial after the other."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from itertools import takewhile
from math import inf
from typing import Any

import ray
from ray.exceptions import RayActorError, RayTaskError

from cluster.config import HardwareSettings
from cluster.errors import UserError
from cluster.hardware import journal, operator
from cluster.hardware.actor import actor_options
from cluster.hardware.connect import LEAVE_SECONDS, POLL_SECONDS, Say, at_the_robot, require_robot_host
from cluster.hardware.plan import CampaignPlan
from cluster.hardware.states import TERMINAL, State
from cluster.hardware.status import Phase, Status
from cluster.runtime.session import Session
from cluster.tracking import Run, Tracker
from workers.hardware import robots

BROKEN = frozenset({State.FAILED, State.ABORTED})
MOST_REJECTED = 20
"""So many trials in a row that the robot's limits reject say that limits and controllers do not fit."""
WAITS = frozenset({Phase.AWAITS_APPROVAL, Phase.RESTS})
"""In these nobody has to do anything at the command."""

Report = Callable[[Status], None]


def start(
    settings: HardwareSettings,
    session: Session,
    tracker: Tracker,
    plan: CampaignPlan,
    report: Report,
    say: Say,
) -> Status:
    """Carries a campaign out, or goes on with it, until it is complete.

    Args:
        settings: of the hardware section.
        session: a Ray cluster one of whose machines offers the resource `hardware`.
        tracker: records every measured trial.
        plan: what to carry out.
        report: is given every new state of the campaign.
        say: is given sentences for the person in charge.

    Returns:
        How the campaign stands at its end.

    Raises:
        UserError: when the campaign cannot go on without a person; the message says what they must do.
    """
    require_robot_host()
    robot = robots.find(plan.identity.robot)
    if robot.simulated:
        say(f"{robot.name} is a {robots.STAND_IN} for {robot.setup}: no robot moves")
    lifetime = "non_detached" if session.is_local else "detached"
    options = actor_options(plan.identity.robot, settings.namespace, lifetime)
    with _ray_errors(plan), at_the_robot(options, plan, say) as (actor, first):
        parameters = {**asdict(plan.identity), "folder": str(plan.folder)}
        tags = {"svaedc.campaign": first.name, "svaedc.robot": robots.STAND_IN if robot.simulated else "real"}
        with tracker.run(first.name, "hardware", parameters, tags) as run:
            return _carry_out(actor, plan, first, run, report, say)


def _carry_out(actor: Any, plan: CampaignPlan, first: Status, run: Run, report: Report, say: Say) -> Status:
    """Asks for one trial after the other, and records each."""
    _record(run, first, 0)
    report(first)
    before, told = first, (Phase.READY, -1)
    while before.phase is not Phase.COMPLETE:
        if before.phase in (Phase.AWAITS_RESOLUTION, Phase.STOPPED):
            raise UserError(before.advice)
        if before.phase in WAITS:
            told = _tell_once(before, told, say)
            time.sleep(POLL_SECONDS)
        now = _answer(actor.advance.remote(plan), before, say)
        if now.trials != before.trials:
            _record(run, now, before.measured)
            report(now)
        if now.trials and now.trials[-1].state in BROKEN:
            raise UserError(now.advice)
        if _rejected_in_a_row(now) >= MOST_REJECTED:
            raise UserError(f"{MOST_REJECTED} controllers in a row were rejected; {now.advice}")
        before = now
    return before


def _tell_once(now: Status, told: tuple[Phase, int], say: Say) -> tuple[Phase, int]:
    """Say what the command waits for, once for each trial."""
    wait = (now.phase, len(now.trials))
    if wait != told:
        say(now.advice)
    return wait


def _rejected_in_a_row(now: Status) -> int:
    states = [trial.state for trial in now.trials]
    return len(list(takewhile(lambda state: state is State.REJECTED, reversed(states))))


def _answer(reference: Any, before: Status, say: Say) -> Status:
    """Waits for a trial; Ctrl-C lets it end, a second one cuts it."""
    try:
        return ray.get(reference)
    except KeyboardInterrupt:
        say("stopping after the trial under way; press Ctrl-C again to cut it")
    try:
        ray.get(reference)
    except KeyboardInterrupt:
        number = next((trial.number for trial in before.trials if trial.state not in TERMINAL), None)
        what = f"trial {number}" if number is not None else "the trial"
        say(
            f"{what} was cut where it was: its host brings the robot to rest. If it had begun to move the "
            f"robot, a person must say what became of it: repeat the start command, or see svaedc hardware "
            f"status {before.folder}"
        )
    raise KeyboardInterrupt


def _record(run: Run, status: Status, recorded: int) -> None:
    """Sends the measured trials after the first `recorded` to the tracker, the trial's number as step."""
    best = -inf
    for count, trial in enumerate(trial for trial in status.trials if trial.state is State.MEASURED):
        f, y = trial.measurement
        best = max(best, f)
        if count >= recorded:
            run.metrics({"f": f, "y": y, "best": best}, step=trial.number)


@contextmanager
def _ray_errors(plan: CampaignPlan) -> Iterator[None]:
    """Turns what Ray raises into what happened at the robot."""
    try:
        yield
    except RayTaskError as error:
        if isinstance(error.cause, UserError):
            raise error.cause from None
        raise
    except RayActorError as error:
        raise UserError(_after_loss(plan)) from error


def _after_loss(plan: CampaignPlan) -> str:
    """What is known once the actor is gone: a trial it may have been running is unknown, never repeated."""
    if not (plan.folder / journal.FILE).exists():
        return (
            "lost the process at the robot; whether its trial ran is not known here: repeat the start "
            "command, which examines it, or look with svaedc hardware status on the robot's machine"
        )
    operator.close_abandoned(plan.folder, LEAVE_SECONDS)
    return f"lost the process at the robot; {operator.status(plan.folder).advice}"
