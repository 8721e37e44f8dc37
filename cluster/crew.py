"""A crew of Ray actors: each gets work only after its first answer, and is replaced when it is lost."""

import re
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

import ray
from ray.exceptions import RayActorError, RayError, RayTaskError

from cluster.errors import UserError
from cluster.progress import say

_RETRY_SECONDS = 2.0
_COLOUR = re.compile(r"\x1b\[[0-9;]*m")

Item = TypeVar("Item")


@dataclass(eq=False)
class Member(Generic[Item]):
    """A place in the crew, and the actor that fills it now.

    Attributes:
        actor: the actor's handle; None between a failed start and the next.
        starting: reference of its first answer; None once it is there.
        is_replacement: whether an actor was lost from this place.
        due: earliest time of the next start, if the actor is None.
        tasks: its work: reference of the result -> item, oldest first.
        since: when the oldest of them began.
    """

    actor: Any = None
    starting: Any = None
    is_replacement: bool = False
    due: float = 0.0
    tasks: dict[Any, Item] = field(default_factory=dict)
    since: float = 0.0

    @property
    def is_ready(self) -> bool:
        """Whether it may be given work, and blamed for it."""
        return self.actor is not None and self.starting is None


class Crew(Generic[Item]):
    """Actors of one kind, each in its place.

    Args:
        spawn: starts one actor, which has a method `ready`, and returns its handle.
        size: how many actors.
        patience: seconds that may pass without a single actor that is ready.
    """

    def __init__(self, *, spawn: Callable[[], Any], size: int, patience: float) -> None:
        self._spawn = spawn
        self._patience = patience
        self._manned = time.monotonic()  # when an actor was last seen ready
        self._complaint = ""
        self.members: list[Member[Item]] = [Member() for _ in range(size)]
        self.answers: list[Any] = []  # the first one of every actor there ever was

    def tend(self) -> None:
        """Start actors in empty places.

        Raises:
            UserError: no actor has been ready for too long.
        """
        now = time.monotonic()
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

    def starting(self) -> list[Any]:
        """References of the first answers that are still awaited."""
        return [member.starting for member in self.members if member.starting is not None]

    def welcome(self, member: Member[Item]) -> None:
        """Take note of a member's first answer.

        A replacement that cannot start is tried again, for its machine may be in trouble that passes.

        Raises:
            UserError: an actor of the beginning cannot start; it would not with any item.
        """
        try:
            answer = ray.get(member.starting)
        except RayError as error:
            if not member.is_replacement:
                raise UserError(f"a worker process cannot start: {in_one_line(error)}") from error
            self._complain(in_one_line(error))
            self.replace(member)
            member.due = time.monotonic() + _RETRY_SECONDS
        else:
            member.starting = None
            self.answers.append(answer)

    def replace(self, member: Member[Item]) -> list[Item]:
        """Empty a place, for `tend` to fill it; returns the items its actor had, oldest first."""
        items = list(member.tasks.values())
        member.tasks.clear()
        ray.kill(member.actor)  # one that is only out of reach would keep its CPU
        member.actor = member.starting = None
        member.is_replacement = True
        member.due = 0.0
        return items

    def dismiss(self) -> None:
        """End every actor."""
        for member in self.members:
            if member.actor is not None:
                ray.kill(member.actor)

    def _complain(self, complaint: str) -> None:
        if complaint != self._complaint:
            say(f"a worker process that replaces a lost one cannot start yet: {complaint}")
        self._complaint = complaint


def full_text(error: RayError) -> str:
    """All that Ray tells of an error, the traceback in the actor included."""
    return _COLOUR.sub("", str(error)).strip()


def in_one_line(error: RayError) -> str:
    """Type and message of the exception in the actor, or how the actor ended."""
    if isinstance(error, RayTaskError) and error.cause is not None:
        return f"{type(error.cause).__name__}: {error.cause}".partition("\n")[0]
    lines = full_text(error).splitlines() or [type(error).__name__]
    # An actor's death ends with its reason; whatever else befalls it begins with that.
    return lines[-1 if isinstance(error, RayActorError) else 0].strip()
