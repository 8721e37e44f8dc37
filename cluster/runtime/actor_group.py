"""A group of Ray actors: each gets work only after its first answer, and is replaced when it is lost.

It may grow with the cluster: a place is added for a CPU that becomes free, and closed with its machine.
"""

import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import ray
from ray.exceptions import RayActorError, RayError, RayTaskError

from cluster.errors import UserError
from cluster.progress import say
from cluster.runtime.machines import free_cpus, is_there, machine_of, own_machine

_RETRY_SECONDS = 2.0
_LONGEST_RETRY_SECONDS = 60.0
_LOOK_SECONDS = 5.0
_COLOR = re.compile(r"\x1b\[[0-9;]*m")

Item = TypeVar("Item")


@dataclass(eq=False)
class Member(Generic[Item]):
    """A place in the group, and the actor that fills it now.

    Attributes:
        actor: the actor's handle; None between a failed start and the next.
        starting: reference of its first answer; None once it is there.
        machine: id of the machine on which the actor answered.
        is_late: whether an actor was lost from this place, or the place was added later.
        failures: starts that failed since the last one that did not.
        due: earliest time of the next start, if the actor is None.
        tasks: its work: reference of the result -> item, oldest first.
        since: when the oldest of them began.
    """

    actor: Any = None
    starting: Any = None
    machine: str = ""
    is_late: bool = False
    failures: int = 0
    due: float = 0.0
    tasks: dict[Any, Item] = field(default_factory=dict)
    since: float = 0.0

    @property
    def is_ready(self) -> bool:
        """Whether it may be given work, and blamed for it."""
        return self.actor is not None and self.starting is None


class ActorGroup(Generic[Item]):
    """Actors of one kind, each in its place.

    Args:
        spawn: starts one actor, which has a method `ready`, and returns its handle.
        size: how many actors there are at first.
        most: how many there may be; with more than `size`, places come and go with the cluster's CPUs.
        patience: seconds that may pass without a single actor that is ready.

    Attributes:
        members: the places.
        answers: the first answer of every actor there ever was.
        seconds: that all places together have existed, in seconds.
    """

    def __init__(self, *, spawn: Callable[[], Any], size: int, most: int, patience: float) -> None:
        self._spawn = spawn
        self._most = most
        self._grows = most > size
        self._patience = patience
        self._own = own_machine()
        self._left: set[str] = set()  # machines that are no longer there
        self._tended = self._look_due = time.monotonic()
        self._manned = self._tended  # when an actor was last seen ready
        self._complaint = ""
        self.members: list[Member[Item]] = [Member() for _ in range(size)]
        self.answers: list[Any] = []
        self.seconds = 0.0

    def tend(self, waiting: int) -> None:
        """Start actors in empty places, and in new ones if CPUs are free for work that waits.

        Args:
            waiting: how many items no actor has yet.

        Raises:
            UserError: no actor has been ready for too long, or Ray on this machine has ended.
        """
        now = time.monotonic()
        self.seconds += (now - self._tended) * len(self.members)
        self._tended = now
        if now >= self._look_due:
            self._look_due = now + _LOOK_SECONDS
            self._look(waiting)
        for member in self.members:
            if member.actor is None and member.due <= now:
                member.actor = self._spawn()
                member.starting = member.actor.ready.remote()
        if any(member.is_ready for member in self.members):
            self._manned = now
        elif now - self._manned > self._patience:
            reason = self._complaint or "no machine of the cluster has a CPU free for one"
            raise UserError(
                f"no worker process could start within {self._patience:g} s: {reason}; "
                "run the same command again once that is over"
            )

    def _look(self, waiting: int) -> None:
        if not is_there(self._own):
            raise UserError("Ray has ended on this machine, killed perhaps; run the same command again")
        if all(member.is_ready for member in self.members):
            room = min(free_cpus(), self._most - len(self.members), waiting)
            self.members += [Member(is_late=True) for _ in range(room)]
            if room > 0:
                say(f"{room} more CPUs are free: {len(self.members)} worker processes from now on")

    def starting(self) -> list[Any]:
        """References of the first answers that are still awaited."""
        return [member.starting for member in self.members if member.starting is not None]

    def welcome(self, member: Member[Item]) -> None:
        """Take note of a member's first answer.

        One that was killed, or comes late and cannot start, is tried again: its machine may be in trouble
        that passes.

        Raises:
            UserError: an actor of the beginning raises an error; it would with any item.
        """
        try:
            answer = ray.get(member.starting)
        except RayError as error:
            if not member.is_late and isinstance(error, RayActorError) and error.actor_init_failed:
                raise UserError(f"a worker process cannot start: {in_one_line(error)}") from error
            self._complain(in_one_line(error))
            self.replace(member)
            member.due = time.monotonic() + min(_RETRY_SECONDS * 2**member.failures, _LONGEST_RETRY_SECONDS)
            member.failures += 1
        else:
            member.starting = None
            member.failures = 0
            member.machine = machine_of(member.actor)
            self.answers.append(answer)

    def has_left(self, member: Member[Item]) -> bool:
        """Whether the machine on which a member's actor was is no longer there."""
        if member.machine and member.machine not in self._left and not is_there(member.machine):
            self._left.add(member.machine)
            self._look_due = 0.0
            say("a machine has left the cluster; what it was working on is done again elsewhere")
        return member.machine in self._left

    def replace(self, member: Member[Item]) -> list[Item]:
        """Empty a place, for `tend` to fill it, or close it; returns its actor's items, oldest first."""
        if self._grows and len(self.members) > 1 and self.has_left(member):
            self.members = [other for other in self.members if other is not member]
        items = list(member.tasks.values())
        member.tasks.clear()
        ray.kill(member.actor)  # one that is only out of reach would keep its CPU
        member.actor = member.starting = None
        member.is_late = True
        member.machine = ""
        member.due = 0.0
        return items

    def dismiss(self) -> None:
        """End every actor."""
        for member in self.members:
            if member.actor is not None:
                ray.kill(member.actor)

    def _complain(self, complaint: str) -> None:
        if complaint != self._complaint:
            say(f"a worker process cannot start yet: {complaint}")
        self._complaint = complaint


def full_text(error: RayError) -> str:
    """All that Ray tells of an error, the traceback in the actor included."""
    return _COLOR.sub("", str(error)).strip()


def in_one_line(error: RayError) -> str:
    """Type and message of the exception in the actor, or how the actor ended."""
    if isinstance(error, RayTaskError) and error.cause is not None:
        return f"{type(error.cause).__name__}: {error.cause}".partition("\n")[0]
    lines = full_text(error).splitlines() or [type(error).__name__]
    # An actor's death ends with its reason; whatever else befalls it begins with that.
    told = lines[-1 if isinstance(error, RayActorError) else 0]
    return told.partition(" Some common causes include")[0].strip()
