"""The way to the robot: its one actor found or made, waited for, and left again."""

import gc
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from math import inf
from typing import Any

import ray
from ray.exceptions import ActorAlreadyExistsError, ActorDiedError
from ray.util import list_named_actors

from cluster.errors import UserError
from cluster.hardware.actor import PREFIX, RESOURCE, HardwareActor
from cluster.hardware.plan import CampaignPlan
from cluster.hardware.status import Status
from cluster.runtime.machines import has_a_place
from cluster.runtime.ray_internals import claim_name, give_up_name

POLL_SECONDS = 0.5
ENTRANCES = 10
LEAVE_SECONDS = 5.0
TAKEOVER_SECONDS = 15.0
"""The command of a driver that was killed can be repeated within this."""
NOTICE_SECONDS = 10.0
"""After this a person is told what the command waits for."""
PLACE_SECONDS = 120.0
"""An actor gets a place on the robot's machine within this, or the command ends."""

Say = Callable[[str], None]


def require_robot_host() -> None:
    """Refuses a cluster without a robot.

    Raises:
        UserError: when no machine offers the resource.
    """
    if ray.cluster_resources().get(RESOURCE, 0.0) < 1.0:
        raise UserError(
            f"no machine of the Ray cluster offers the resource {RESOURCE!r}; start the robot's machine "
            f"with: ray start --resources '{{\"{RESOURCE}\": 1}}'"
        )


@contextmanager
def at_the_robot(options: dict[str, Any], plan: CampaignPlan, say: Say) -> Iterator[tuple[Any, Status]]:
    """The robot's actor, the plan entered; it ends after its present trial, whatever happens to the driver.

    Args:
        options: of the actor, `actor_options`.
        plan: what to carry out.
        say: is told what the command waits for.

    Yields:
        Handle of the actor, and how the campaign stood when the plan was entered.

    Raises:
        UserError: when there is no place on the robot's machine, another command drives it, or the plan
            cannot be carried out.
    """
    with _alone(f"{options['namespace']}/{options['name']}", plan):
        actor, first = _enter(options, plan, say)
        try:
            yield actor, first
        finally:
            _withdraw(actor, plan)


@contextmanager
def _alone(name: str, plan: CampaignPlan) -> Iterator[None]:
    """The robot's actor for this command alone: another one's Ctrl-C must not end this one's trial."""
    deadline = time.monotonic() + TAKEOVER_SECONDS
    while other := claim_name(name):
        if time.monotonic() >= deadline:  # Ray takes a moment to notice a driver's death
            raise UserError(
                f"the robot {plan.identity.robot!r} is driven by another command already, process "
                f"{other['DriverPid']} on {other['DriverIPAddress']}: wait until it has ended, or end it"
            )
        time.sleep(POLL_SECONDS)
    try:
        yield
    finally:
        give_up_name(name)


def _enter(options: dict[str, Any], plan: CampaignPlan, say: Say) -> tuple[Any, Status]:
    deadline, made = time.monotonic() + PLACE_SECONDS, 0
    while made < ENTRANCES and time.monotonic() < deadline:
        actor, is_new = _find_or_make(options)
        made += is_new
        try:
            return actor, _wait_for_entry(actor, options, plan, deadline, say)
        except ActorDiedError:
            # An earlier driver's actor on its way out: entering moves nothing, so it may be tried again.
            del actor
            time.sleep(POLL_SECONDS)
        except BaseException:
            if is_new:
                _end(actor, plan)
            raise
    raise _dies_at_once(options)


def _find_or_make(options: dict[str, Any]) -> tuple[Any, bool]:
    """The robot's actor, and whether it is new: one that was there before is not for this command to end."""
    gc.collect()  # a name means its dead actor for as long as a handle of that one lives in this process
    for _ in range(ENTRANCES):
        with suppress(ValueError):
            return ray.get_actor(options["name"], options["namespace"]), False
        with suppress(ActorAlreadyExistsError):  # made by another command a moment ago
            return ray.remote(HardwareActor).options(**options).remote(), True
    raise _dies_at_once(options)


def _dies_at_once(options: dict[str, Any]) -> UserError:
    return UserError(
        f"the actor {options['name']} dies whenever it starts; look into the Ray logs of the robot's machine"
    )


def _wait_for_entry(
    actor: Any, options: dict[str, Any], plan: CampaignPlan, deadline: float, say: Say
) -> Status:
    """Waits up to the deadline for an actor without a place, and for one at work until it answers.

    A trial under way may take any time, and nothing here can tell its end from outside.
    """
    answer, notice = actor.enter.remote(plan), time.monotonic() + NOTICE_SECONDS
    while not ray.wait([answer], timeout=POLL_SECONDS)[0]:
        is_busy = has_a_place(actor)
        if time.monotonic() >= notice:
            say(_at_work(plan) if is_busy else f"waiting for a place: {_no_place(_others(options))}")
            notice = inf
        if not is_busy and time.monotonic() >= deadline:
            require_robot_host()
            raise UserError(_no_place(_others(options)))
    return ray.get(answer)


def _end(actor: Any, plan: CampaignPlan) -> None:
    """Ends an actor that this command made in vain: it never asked it for a trial.

    One without a place would take it later, for nobody, and what is asked of it now dies with this command.
    """
    if has_a_place(actor):
        _withdraw(actor, plan)
    else:
        ray.kill(actor)


def _withdraw(actor: Any, plan: CampaignPlan) -> None:
    ray.wait([actor.withdraw.remote(plan)], timeout=LEAVE_SECONDS)


def _others(options: dict[str, Any]) -> list[str]:
    """The actors of other campaigns, in every namespace."""
    own = (options["namespace"], options["name"])
    listed: list[Any] = list_named_actors(all_namespaces=True)
    found = sorted((entry["namespace"], entry["name"]) for entry in listed)
    return [
        f"{name} in the namespace {namespace!r}"
        for namespace, name in found
        if name.startswith(PREFIX) and (namespace, name) != own
    ]


def _no_place(others: list[str]) -> str:
    if others:
        return (
            f"the robot's machine is taken by {', '.join(others)}; wait until that campaign has ended or, if "
            "its command was killed, repeat that command, which ends what it left behind"
        )
    if ray.available_resources().get(RESOURCE, 0.0) >= 1.0:
        return (
            f"no campaign and no other work holds the resource {RESOURCE!r}: Ray is slow to start a process "
            "on the robot's machine, which may be busy or short of memory (see its Ray logs)"
        )
    return (
        "no other campaign is there: either Ray is slow to start a process on the robot's machine, which "
        f"may be busy (see its Ray logs), or other work holds the resource {RESOURCE!r} (see ray status)"
    )


def _at_work(plan: CampaignPlan) -> str:
    return f"the process at {plan.identity.robot} is at work, on a trial perhaps; waiting until it has ended"
