"""A pool of replaceable Ray actors: bounded work in flight, retries counted per item, time limits."""

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import Any, Generic, TypeVar

import ray
from ray.exceptions import RayError, RayTaskError

from cluster.runtime.actor_group import ActorGroup, Member, full_text, in_one_line

MACHINES = 10
"""An item is given up after the loss of that many machines: it may be what brings them down."""

_POLL_SECONDS = 1.0

Item = TypeVar("Item")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Done(Generic[Item, Result]):
    """An item that succeeded."""

    item: Item
    result: Result


@dataclass(frozen=True)
class Failed(Generic[Item]):
    """An attempt that failed.

    Attributes:
        item: what was attempted.
        error: why, in one line.
        text: all that is known, the traceback in the actor included.
        cause: the exception raised in the actor; None when the actor died or ran out of time.
        attempts_left: the item is tried again unless this is 0.
    """

    item: Item
    error: str
    text: str
    cause: BaseException | None
    attempts_left: int


@dataclass(frozen=True)
class Limits:
    """How hard a pool tries.

    Attributes:
        in_flight: items handed to an actor at a time.
        attempts: of one item, before it is given up; those whose machine left do not count.
        seconds: of one attempt, before its actor is killed and replaced.
        start_seconds: without a single actor that is ready for work, before all is given up.
    """

    in_flight: int
    attempts: int
    seconds: float
    start_seconds: float = 300.0


class Pool(Generic[Item, Result]):
    """Runs items on actors until every one is done or given up.

    Args:
        spawn: starts one actor, which has a method `ready`, and returns its handle.
        submit: hands an item to an actor and returns the object reference of its result; it is told how many
            actors were lost with the item before.
        size: how many actors there are at first.
        limits: of the work in flight.
        most: how many actors there may be, as CPUs become free; `size` if that is more.
    """

    def __init__(
        self,
        *,
        spawn: Callable[[], Any],
        submit: Callable[[Any, Item, int], Any],
        size: int,
        limits: Limits,
        most: int = 0,
    ) -> None:
        self._submit = submit
        self._limits = limits
        self._actors: ActorGroup[Item] = ActorGroup(
            spawn=spawn, size=size, most=max(size, most), patience=limits.start_seconds
        )
        self._queue: deque[Item] = deque()
        self._attempts: Counter[Item] = Counter()
        self._machines: Counter[Item] = Counter()
        self._deaths: Counter[Item] = Counter()

    @property
    def answers(self) -> list[Any]:
        """What the actors' `ready` returned, those of actors that were replaced included."""
        return self._actors.answers

    @property
    def actor_seconds(self) -> float:
        """For how long there were actors, summed over them."""
        return self._actors.seconds

    def __enter__(self) -> "Pool[Item, Result]":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._actors.dismiss()

    def run(self, items: list[Item]) -> Iterator[Done[Item, Result] | Failed[Item]]:
        """Yield the outcome of every attempt, in the order they end.

        Raises:
            UserError: actors cannot start, which is no fault of the items.
        """
        self._queue.extend(items)
        while self._queue or any(member.tasks for member in self._actors.members):
            self._actors.tend(len(self._queue))
            self._fill()
            for outcome in [*self._take_finished(), *self._overdue()]:
                if isinstance(outcome, Failed) and outcome.attempts_left:
                    self._queue.append(outcome.item)
                yield outcome

    def _fill(self) -> None:
        for member in self._actors.members:
            while member.is_ready and self._queue and len(member.tasks) < self._limits.in_flight:
                item = self._queue.popleft()
                if not member.tasks:
                    member.since = time.monotonic()
                member.tasks[self._submit(member.actor, item, self._deaths[item])] = item

    def _take_finished(self) -> Iterator[Done[Item, Result] | Failed[Item]]:
        pending = self._actors.starting()
        pending += [task for member in self._actors.members for task in member.tasks]
        if not pending:
            time.sleep(_POLL_SECONDS)
            return
        ready, _ = ray.wait(pending, num_returns=1, timeout=_POLL_SECONDS)
        for reference in ready:
            for member in self._actors.members:
                if reference in member.tasks:
                    yield from self._outcomes(member, reference)
                elif reference == member.starting:
                    self._actors.welcome(member)

    def _outcomes(self, member: Member[Item], task: Any) -> Iterator[Done[Item, Result] | Failed[Item]]:
        try:
            result = ray.get(task)
        except RayTaskError as error:
            item = self._take(member, task)
            self._attempts[item] += 1
            yield self._failure(item, in_one_line(error), full_text(error), error.cause)
        except RayError as error:  # its process or machine is gone, or was out of memory
            died = f"its worker process died: {in_one_line(error)}"
            yield from self._replace(member, died, full_text(error))
        else:
            yield Done(self._take(member, task), result)

    def _take(self, member: Member[Item], task: Any) -> Item:
        member.since = time.monotonic()
        return member.tasks.pop(task)

    def _overdue(self) -> Iterator[Failed[Item]]:
        for member in self._actors.members:
            if not member.tasks or time.monotonic() - member.since <= self._limits.seconds:
                continue
            done, _ = ray.wait(list(member.tasks), num_returns=1, timeout=0)
            if not done:  # else it was this process that stood still
                slow = f"took longer than {self._limits.seconds:g} s"
                yield from self._replace(member, slow, slow)

    def _replace(self, member: Member[Item], error: str, text: str) -> Iterator[Failed[Item]]:
        """A new actor in the place of a lost one; only the item it was working on has failed."""
        has_left = self._actors.has_left(member)
        failed, *waiting = self._actors.replace(member)
        self._queue.extendleft(reversed(waiting))
        (self._machines if has_left else self._attempts)[failed] += 1
        self._deaths[failed] += not has_left
        yield self._failure(failed, f"its machine left: {error}" if has_left else error, text, None)

    def _failure(self, item: Item, error: str, text: str, cause: BaseException | None) -> Failed[Item]:
        is_spent = self._machines[item] >= MACHINES
        left = 0 if is_spent else self._limits.attempts - self._attempts[item]
        return Failed(item, error, text, cause, left)
