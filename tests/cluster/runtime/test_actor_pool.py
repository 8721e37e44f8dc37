"""The pool of actors: every item done or given up, whatever its worker does."""

import os
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import ray

from cluster.errors import UserError
from cluster.runtime.actor_pool import Done, Failed, Limits, Pool
from cluster.runtime.machines import is_there, own_machine

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


class Fragile(Worker):
    """Cannot start twice after an item was attempted, or never again."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        outages = len(list(folder.glob("outage.*")))
        if list(folder.glob("dies-1.*")) and (outages < 2 or (folder / "for ever").exists()):
            (folder / f"outage.{outages}").touch()
            raise OSError("the folder is away")


class Stillborn(Worker):
    """Is killed once while it starts."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        if not (folder / "killed").exists():
            (folder / "killed").touch()
            self._die()


class Holder:
    """Occupies CPUs."""

    def ready(self) -> None:
        pass


class Unstartable:
    """Has no chance."""

    def __init__(self) -> None:
        raise RuntimeError("there is no robot here")

    def ready(self) -> None:
        pass


def die() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def pool_of(spawn: Callable[[], Any], size: int, limits: Limits) -> Pool[str, str]:
    return Pool(spawn=spawn, submit=lambda worker, item, _: worker.run.remote(item), size=size, limits=limits)


def outcomes(folder: Path, items: list[str], limits: Limits, size: int = 2) -> list[Done | Failed]:
    actor = ray.remote(Worker).options(num_cpus=1)
    with pool_of(lambda: actor.remote(folder), size, limits) as pool:
        return list(pool.run(items))


@contextmanager
def cpus_held(count: int) -> Iterator[None]:
    """Somebody else's work on the cluster of four CPUs."""
    holder = ray.remote(Holder).options(num_cpus=count).remote()
    ray.get(holder.ready.remote())
    yield
    ray.kill(holder)


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
    assert last.error == "ValueError: this item is broken"
    assert 'raise ValueError("this item is broken")' in last.text
    assert "\x1b" not in last.text
    assert isinstance(last.cause, ValueError)
    assert len(list(tmp_path.glob("raises-9.*"))) == 3


def test_a_hung_worker_is_replaced_and_stalls_nothing(tmp_path):
    limits = Limits(in_flight=1, attempts=3, seconds=4.0)
    results = outcomes(tmp_path, ["hangs-1", "works0-0", "works1-0"], limits)
    assert done(results) == ["hangs-1", "works0-0", "works1-0"]
    assert any(isinstance(result, Failed) and "longer than 4 s" in result.error for result in results)


@pytest.mark.slow
def test_work_that_was_done_while_the_driver_stood_still_is_not_overdue(tmp_path):
    limits = Limits(in_flight=2, attempts=1, seconds=2.0)
    actor = ray.remote(Worker).options(num_cpus=1)
    results = []
    with pool_of(lambda: actor.remote(tmp_path), 2, limits) as pool:
        while len(pool.answers) < 2:
            list(pool.run(["warms up-0"]))
        for result in pool.run([f"works{index}-0" for index in range(6)]):
            results.append(result)
            if len(results) == 1:
                time.sleep(3.0)
    assert done(results) == [f"works{index}-0" for index in range(6)]
    assert len(results) == 6


def test_work_queued_behind_a_dead_worker_is_not_blamed(tmp_path):
    limits = Limits(in_flight=2, attempts=2, seconds=60.0)
    results = outcomes(tmp_path, ["dies-1", "works-0"], limits, size=1)
    assert done(results) == ["dies-1", "works-0"]
    assert [result.item for result in results if isinstance(result, Failed)] == ["dies-1"]


def test_actors_that_cannot_start_end_the_work_at_once_with_their_reason():
    actor = ray.remote(Unstartable).options(num_cpus=0)
    with (
        pytest.raises(UserError, match="cannot start: RuntimeError: there is no robot here"),
        pool_of(actor.remote, 1, PATIENT) as pool,
    ):
        list(pool.run(["works-0"]))


@pytest.mark.slow
def test_a_worker_that_is_killed_while_it_starts_is_replaced(tmp_path, capsys):
    actor = ray.remote(Stillborn).options(num_cpus=1)
    with pool_of(lambda: actor.remote(tmp_path), 1, PATIENT) as pool:
        assert list(pool.run(["works-0"])) == [Done("works-0", "works-0")]
    assert "a worker process cannot start yet" in capsys.readouterr().err


@pytest.mark.slow
def test_a_crew_that_may_grow_takes_the_cpus_that_become_free_and_no_more_than_there_is_work(tmp_path):
    """One CPU of four is held for ever, two until the work has begun."""
    actor = ray.remote(Worker).options(num_cpus=1)
    pool = Pool(
        spawn=lambda: actor.remote(tmp_path),
        submit=lambda worker, item, _: worker.run.remote(item),
        size=1,
        limits=PATIENT,
        most=9,
    )
    with cpus_held(1), pool:
        with cpus_held(2):
            results = list(pool.run(["works0-0"]))
            assert len(pool.answers) == 1
        deadline = time.monotonic() + 120
        while len(pool.answers) < 3:
            assert time.monotonic() < deadline
            results += pool.run([f"works{len(results) + number}-0" for number in range(40)])
        assert len(pool.answers) == 3
    assert len(done(results)) == len(results)


def test_a_machine_is_there_while_it_answers():
    assert is_there(own_machine())
    assert not is_there("0" * 56)


@pytest.mark.slow
def test_losing_a_worker_in_any_way_that_ray_knows_is_a_failed_attempt(tmp_path):
    """A process killed for want of memory is no death of an actor to Ray, nor is that of a task."""
    crash = ray.remote(die).options(max_retries=0, num_cpus=0)
    crashes = [crash]

    def submit(worker, item, deaths):  # noqa: ARG001
        return crashes.pop().remote() if crashes else worker.run.remote(item)

    actor = ray.remote(Worker).options(num_cpus=1)
    with Pool(spawn=lambda: actor.remote(tmp_path), submit=submit, size=1, limits=PATIENT) as pool:
        results = list(pool.run(["works-0"]))
    assert done(results) == ["works-0"]
    assert [result.attempts_left for result in results if isinstance(result, Failed)] == [2]


def test_workers_without_a_free_cpu_leave_the_work_to_the_others(tmp_path):
    with cpus_held(3):
        results = outcomes(tmp_path, ["works0-0", "works1-0", "works2-0"], PATIENT, size=2)
    assert done(results) == ["works0-0", "works1-0", "works2-0"]


def test_no_free_cpu_at_all_ends_the_wait_with_the_reason(tmp_path):
    hurried = Limits(in_flight=1, attempts=3, seconds=60.0, start_seconds=2.0)
    with cpus_held(4), pytest.raises(UserError, match=r"could start within 2 s: .* has a CPU free"):
        outcomes(tmp_path, ["works-0"], hurried)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_a_replacement_that_cannot_start_yet_costs_no_attempt(tmp_path, capsys):
    """The only worker dies, and the machine lets nothing start for a while."""
    limits = Limits(in_flight=2, attempts=2, seconds=1.0)
    actor = ray.remote(Fragile).options(num_cpus=1)
    with pool_of(lambda: actor.remote(tmp_path), 1, limits) as pool:
        results = list(pool.run(["dies-1", "works0-0", "works1-0"]))
    assert done(results) == ["dies-1", "works0-0", "works1-0"]
    assert [result.item for result in results if isinstance(result, Failed)] == ["dies-1"]
    assert len(list(tmp_path.glob("outage.*"))) == 2
    assert capsys.readouterr().err.count("cannot start yet: OSError: the folder is away") == 1


@pytest.mark.slow
def test_replacements_that_never_start_end_the_work_with_their_reason(tmp_path):
    limits = Limits(in_flight=1, attempts=2, seconds=60.0, start_seconds=10.0)
    actor = ray.remote(Fragile).options(num_cpus=1)
    (tmp_path / "for ever").touch()
    with (
        pytest.raises(UserError, match="could start within 10 s: OSError: the folder is away"),
        pool_of(lambda: actor.remote(tmp_path), 1, limits) as pool,
    ):
        list(pool.run(["dies-1", "works-0"]))
    assert not list(tmp_path.glob("works-0.*"))
