"""`svaedc hardware start`: one serialized Ray actor at the robot, asked for one trial after the other."""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import asdict
from math import inf
from typing import Any

import ray
from ray.exceptions import ActorDiedError, RayActorError, RayTaskError

from cluster.config import HardwareSettings
from cluster.errors import UserError
from cluster.hardware import journal, operator
from cluster.hardware.plan import Plan
from cluster.hardware.standing import Standing
from cluster.hardware.states import State
from cluster.hardware.station import RobotTaken, Station
from cluster.hardware.status import Status
from cluster.session import Session
from cluster.tracking import Run, Tracker

RESOURCE = "hardware"
POLL_SECONDS = 0.5
ENTRANCES = 10
LEAVE_SECONDS = 5.0
BROKEN = frozenset({State.FAILED, State.REJECTED})

Report = Callable[[Status], None]
Say = Callable[[str], None]


class HardwareActor:
    """The Ray side of a `Station`; it decides nothing."""

    def __init__(self) -> None:
        self._station = Station()

    def enter(self, plan: Plan) -> Status:
        """See `Station.enter`."""
        return self._station.enter(plan)

    def advance(self, plan: Plan) -> Status:
        """See `Station.advance`."""
        return self._station.advance(plan)

    def leave(self) -> None:
        """See `Station.leave`."""
        return self._station.leave()


def actor_options(robot: str, namespace: str, lifetime: str) -> dict[str, Any]:
    """How the one actor of a robot must run: nothing Ray does may start a trial a second time.

    Args:
        robot: in the registry.
        namespace: that everybody who shares the robot uses.
        lifetime: "detached" where the cluster outlives the driver, so that a trial outlives it too.
    """
    return {
        "name": f"hardware-{robot}",
        "namespace": namespace,
        "get_if_exists": True,
        "lifetime": lifetime,
        "num_cpus": 0,
        "resources": {RESOURCE: 1},
        "max_concurrency": 1,
        "max_restarts": 0,
        "max_task_retries": 0,
    }


def start(
    settings: HardwareSettings, session: Session, tracker: Tracker, plan: Plan, report: Report, say: Say
) -> Status:
    """Carries a campaign out, or goes on with it, until it is complete.

    Args:
        settings: of the hardware section.
        session: a Ray cluster one of whose machines offers the resource `hardware`.
        tracker: records every measured trial.
        plan: what to carry out.
        report: is given every new state of the campaign.
        say: is given sentences for the person in charge.

    Raises:
        UserError: when the campaign cannot go on without a person; the message says what they must do.
    """
    _require_robot_host()
    lifetime = "non_detached" if session.is_local else "detached"
    options = actor_options(plan.identity.robot, settings.namespace, lifetime)
    with _explained(plan), _at_the_robot(options, plan) as (actor, first):
        parameters = {**asdict(plan.identity), "folder": str(plan.folder)}
        with tracker.run(first.name, "hardware", parameters, {"svaedc.campaign": first.name}) as run:
            return _carry_out(actor, plan, first, run, report, say)


def _require_robot_host() -> None:
    if ray.cluster_resources().get(RESOURCE, 0.0) < 1.0:
        raise UserError(
            f"no machine of the Ray cluster offers the resource {RESOURCE!r}; start the robot's machine "
            f"with: ray start --resources '{{\"{RESOURCE}\": 1}}'"
        )


@contextmanager
def _at_the_robot(options: dict[str, Any], plan: Plan) -> Iterator[tuple[Any, Status]]:
    """The actor with the plan entered; it ends after its present trial, whatever happens to the driver."""
    actor, first = _entered(options, plan)
    try:
        yield actor, first
    finally:
        left = actor.leave.remote()
        actor.__ray_terminate__.remote()
        ray.wait([left], timeout=LEAVE_SECONDS)


def _entered(options: dict[str, Any], plan: Plan) -> tuple[Any, Status]:
    for _ in range(ENTRANCES):
        actor: Any = ray.remote(HardwareActor).options(**options).remote()
        try:
            return actor, ray.get(actor.enter.remote(plan))
        except ActorDiedError:
            # An earlier driver's actor on its way out: entering moves nothing, so it may be tried again.
            time.sleep(POLL_SECONDS)
        except RobotTaken:
            raise
        except UserError:
            actor.__ray_terminate__.remote()
            raise
    raise UserError(
        f"the actor {options['name']} dies whenever it starts; look into the Ray logs of the robot's machine"
    )


def _carry_out(actor: Any, plan: Plan, first: Status, run: Run, report: Report, say: Say) -> Status:
    """Asks for one trial after the other, and records each."""
    _record(run, first, 0)
    report(first)
    before = first
    while before.standing is not Standing.COMPLETE:
        if before.standing is Standing.AWAITS_RESOLUTION:
            raise UserError(before.advice)
        if before.standing is Standing.AWAITS_APPROVAL:
            time.sleep(POLL_SECONDS)
        now = _answer(actor.advance.remote(plan), say)
        if now != before:
            _record(run, now, before.measured)
            report(now)
        if now.trials[-1].state in BROKEN:
            raise UserError(now.advice)
        before = now
    return before


def _answer(reference: Any, say: Say) -> Status:
    """Waits for a trial; Ctrl-C lets it end, a second one leaves it to its fate."""
    try:
        return ray.get(reference)
    except KeyboardInterrupt:
        say("stopping after the trial under way; press Ctrl-C again to leave at once")
        ray.get(reference)
        raise


def _record(run: Run, status: Status, recorded: int) -> None:
    """Sends the measured trials after the first `recorded` to the tracker, the trial's number as step."""
    best = -inf
    for count, trial in enumerate(trial for trial in status.trials if trial.state is State.MEASURED):
        f, y = trial.measurement
        best = max(best, f)
        if count >= recorded:
            run.metrics({"f": f, "y": y, "best": best}, step=trial.number)


@contextmanager
def _explained(plan: Plan) -> Iterator[None]:
    """Turns what Ray raises into what happened at the robot."""
    try:
        yield
    except RayTaskError as error:
        if isinstance(error.cause, UserError):
            raise error.cause from None
        raise
    except RayActorError as error:
        raise UserError(_after_loss(plan)) from error


def _after_loss(plan: Plan) -> str:
    """What is known once the actor is gone: a trial it may have been running is unknown, never repeated."""
    if not (plan.folder / journal.FILE).exists():
        return (
            "lost the process at the robot; whether its trial ran is not known here: repeat the start "
            "command, which examines it, or look with svaedc hardware status on the robot's machine"
        )
    operator.close_abandoned(plan.folder, LEAVE_SECONDS)
    return f"lost the process at the robot; {operator.status(plan.folder).advice}"
