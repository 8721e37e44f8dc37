"""The pool of actors: every item done or given up, whatever its worker does."""

import os
import signal
import time
from pathlib import Path

import pytest
import ray

from cluster.errors import UserError
from cluster.pool import Done, Failed, Limits, Pool

pytestmark = pytest.mark.usefixtures("ray_session")

PATIENT = Limits(in_flight=1, attempts=3, seconds=60.0)


class Worker:
    """Does what an item's name says, and counts its attempts in a folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def ready(self) -> None:
        pass

    def run(self, item: str) -> str:
        attempts = len(list(self._folder.glob(f"{item}.*")))
        (self._folder / f"{item}.{attempts}").touch()
        kind, _, times = item.rpartition("-")
        if attempts < int(times):
            {"raises": self._raise, "dies": self._die, "hangs": self._hang}[kind]()
        return item

    def _raise(self) -> None:
        raise ValueError("this item is broken")

    def _die(self) -> None:
        os.kill(os.getpid(), signal.SIGKILL)

    def _hang(self) -> None:
        time.sleep(600)


class Unstartable:
    """Has no chance."""

    def __init__(self) -> None:
        raise RuntimeError("there is no robot here")

    def ready(self) -> None:
        pass


def outcomes(folder: Path, items: list[str], limits: Limits, size: int = 2) -> list[Done | Failed]:
    actor = ray.remote(Worker).options(num_cpus=1)
    pool = Pool(
        spawn=lambda: actor.remote(folder),
        submit=lambda worker, item: worker.run.remote(item),
        size=size,
        limits=limits,
    )
    with pool:
        return list(pool.run(items))


def done(results: list[Done | Failed]) -> list[str]:
    return sorted(result.item for result in results if isinstance(result, Done))


def test_every_item_is_done_once(tmp_path):
    items = [f"works{number}-0" for number in range(7)]
    results = outcomes(tmp_path, items, PATIENT)
    assert done(results) == items
    assert len(results) == len(items)


def test_attempts_are_counted_per_item(tmp_path):
    results = outcomes(tmp_path, ["raises-2", "works-0", "dies-1"], PATIENT)
    assert done(results) == ["dies-1", "raises-2", "works-0"]
    failures = [(result.item, result.attempts_left) for result in results if isinstance(result, Failed)]
    assert sorted(failures) == [("dies-1", 2), ("raises-2", 1), ("raises-2", 2)]


def test_an_item_that_keeps_failing_is_given_up_with_its_error(tmp_path):
    results = outcomes(tmp_path, ["raises-9", "works-0"], PATIENT)
    assert done(results) == ["works-0"]
    last = [result for result in results if isinstance(result, Failed)][-1]
    assert last.attempts_left == 0
    assert last.error == "this item is broken"
    assert isinstance(last.cause, ValueError)
    assert len(list(tmp_path.glob("raises-9.*"))) == 3


def test_a_hung_worker_is_replaced_and_stalls_nothing(tmp_path):
    limits = Limits(in_flight=1, attempts=3, seconds=4.0)
    results = outcomes(tmp_path, ["hangs-1", "works0-0", "works1-0"], limits)
    assert done(results) == ["hangs-1", "works0-0", "works1-0"]
    assert any(isinstance(result, Failed) and "longer than 4 s" in result.error for result in results)


def test_work_queued_behind_a_dead_worker_is_not_blamed(tmp_path):
    limits = Limits(in_flight=2, attempts=2, seconds=60.0)
    results = outcomes(tmp_path, ["dies-1", "works-0"], limits, size=1)
    assert done(results) == ["dies-1", "works-0"]
    assert [result.item for result in results if isinstance(result, Failed)] == ["dies-1"]


def test_actors_that_cannot_start_end_the_work_at_once_with_their_reason():
    actor = ray.remote(Unstartable).options(num_cpus=0)
    with pytest.raises(UserError, match="cannot start: RuntimeError: there is no robot here"):
        Pool(spawn=actor.remote, submit=lambda worker, item: worker.run.remote(item), size=1, limits=PATIENT)
