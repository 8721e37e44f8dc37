"""A pool of replaceable Ray actors: bounded work in flight, retries counted per item, time limits."""

import time
from collections import Counter, deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from types import TracebackType
from typing import Any, Generic, TypeVar

import ray
from ray.exceptions import ActorDiedError, ActorUnavailableError, RayActorError, RayTaskError

from cluster.errors import UserError

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
        error: why, in words.
        cause: the exception raised in the actor; None when the actor died or ran out of time.
        attempts_left: the item is tried again unless this is 0.
    """

    item: Item
    error: str
    cause: BaseException | None
    attempts_left: int


@dataclass
class _Worker:
    actor: Any
    tasks: dict[Any, Any] = field(default_factory=dict)  # object reference -> item, oldest first
    since: float = 0.0  # when the oldest task began


@dataclass(frozen=True)
class Limits:
    """How hard a pool tries.

    Attributes:
        in_flight: items handed to an actor at a time.
        attempts: of one item, before it is given up.
        seconds: of one attempt, before its actor is killed and replaced.
    """

    in_flight: int
    attempts: int
    seconds: float


class Pool(Generic[Item, Result]):
    """Runs items on actors until every one is done or given up.

    Args:
        spawn: starts one actor, which has a method `ready`, and returns its handle.
        submit: hands an item to an actor and returns the object reference of its result.
        size: how many actors.
        limits: of the work in flight.
    """

    def __init__(
        self, *, spawn: Callable[[], Any], submit: Callable[[Any, Item], Any], size: int, limits: Limits
    ) -> None:
        self._spawn = spawn
        self._submit = submit
        self._limits = limits
        self._workers = [_Worker(spawn()) for _ in range(size)]
        self._await_start()
        self._attempts: Counter[Item] = Counter()

    def __enter__(self) -> "Pool[Item, Result]":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for worker in self._workers:
            ray.kill(worker.actor)

    def _await_start(self) -> None:
        """Actors that cannot start would fail every item, which is no fault of the items: end at once."""
        try:
            ray.get([worker.actor.ready.remote() for worker in self._workers])
        except ActorDiedError as error:
            raise UserError(f"a worker process cannot start: {_reason(error)}") from error

    def run(self, items: list[Item]) -> Iterator[Done[Item, Result] | Failed[Item]]:
        """Yield the outcome of every attempt, in the order they end."""
        queue = deque(items)
        while queue or any(worker.tasks for worker in self._workers):
            self._fill(queue)
            for outcome in [*self._finished(), *self._overdue()]:
                if isinstance(outcome, Failed) and outcome.attempts_left:
                    queue.append(outcome.item)
                yield outcome

    def _fill(self, queue: deque[Item]) -> None:
        for worker in self._workers:
            while queue and len(worker.tasks) < self._limits.in_flight:
                item = queue.popleft()
                if not worker.tasks:
                    worker.since = time.monotonic()
                worker.tasks[self._submit(worker.actor, item)] = item

    def _finished(self) -> Iterator[Done[Item, Result] | Failed[Item]]:
        pending = [task for worker in self._workers for task in worker.tasks]
        ready, _ = ray.wait(pending, num_returns=1, timeout=_POLL_SECONDS)
        for task in ready:
            worker = next((worker for worker in self._workers if task in worker.tasks), None)
            if worker is not None:
                yield from self._outcomes(worker, task)

    def _outcomes(self, worker: _Worker, task: Any) -> Iterator[Done[Item, Result] | Failed[Item]]:
        try:
            result = ray.get(task)
        except RayTaskError as error:
            yield self._failed(self._take(worker, task), str(error.cause or error), error.cause)
        except (ActorDiedError, ActorUnavailableError) as error:
            yield from self._replace(worker, f"its worker process died: {_reason(error)}")
        else:
            yield Done(self._take(worker, task), result)

    def _take(self, worker: _Worker, task: Any) -> Item:
        worker.since = time.monotonic()
        return worker.tasks.pop(task)

    def _overdue(self) -> Iterator[Failed[Item]]:
        for worker in self._workers:
            if worker.tasks and time.monotonic() - worker.since > self._limits.seconds:
                ray.kill(worker.actor)
                yield from self._replace(worker, f"took longer than {self._limits.seconds:g} s")

    def _replace(self, worker: _Worker, error: str) -> Iterator[Failed[Item]]:
        """A new actor in the place of a lost one; only the item it was working on has failed."""
        items = list(worker.tasks.values())
        worker.tasks.clear()
        worker.actor = self._spawn()
        worker.since = time.monotonic()
        yield self._failed(items[0], error, None)
        for item in items[1:]:
            worker.tasks[self._submit(worker.actor, item)] = item

    def _failed(self, item: Item, error: str, cause: BaseException | None) -> Failed[Item]:
        self._attempts[item] += 1
        return Failed(item, error, cause, self._limits.attempts - self._attempts[item])


def _reason(error: RayActorError) -> str:
    """The last line of what Ray tells of a dead actor: the exception of a constructor, or how it ended."""
    return str(error).strip().splitlines()[-1].strip()
