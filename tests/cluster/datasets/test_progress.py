"""The rates of machines are those of the last minutes."""

import math
import time

import pytest

from cluster.datasets.progress import CollectionProgress, Rates
from workers.collection.shard import ShardReport
from workers.dataset.shards import Shard


def report(machine: str, shard: Shard) -> ShardReport:
    return ShardReport(
        shard=shard,
        badness=0.25,
        diverged=0,
        stopped=0,
        best=0.0,
        size=1000,
        rollout_seconds=1.0,
        storage_seconds=0.1,
        seconds=1.2,
        machine=machine,
    )


def test_rates_count_the_episodes_of_each_machine():
    rates = Rates(begin=time.monotonic() - 100.0)
    for machine, episodes in (("b", 100), ("a", 300), ("b", 100)):
        rates.add(machine, episodes)
    assert list(rates.now()) == ["a", "b"]
    assert rates.now() == {"a": pytest.approx(3.0, rel=0.2), "b": pytest.approx(2.0, rel=0.2)}


def test_a_machine_that_fell_silent_is_seen_to_stand_still():
    rates = Rates(window=0.01)
    rates.add("a", 300)
    time.sleep(0.05)
    rates.add("b", 10)
    assert rates.now()["a"] == 0.0
    assert len(rates._finished) <= 1


def test_one_machine_is_not_named_and_many_are_not_listed():
    rates = Rates(begin=time.monotonic() - 10.0)
    rates.add("m0", 20)
    assert rates.note() == ""
    rates.add("m1", 40)
    assert ", m0 " in rates.note()
    assert ", m1 " in rates.note()
    for number in range(2, 6):
        rates.add(f"m{number}", 20 + 20 * number)
    assert rates.note().startswith(", 6 machines from m0 ")
    assert " to m5 " in rates.note()


def test_a_tally_tells_mlflow_the_time_left_and_the_rate_of_every_machine():
    counts = CollectionProgress(
        planned=40, begin=time.monotonic() - 10.0, rates=Rates(begin=time.monotonic() - 10.0)
    )
    assert math.isnan(counts.metrics()["seconds_left"])
    counts.add(report("one", Shard(0, 8)))
    counts.add(report("two", Shard(8, 10)))
    metrics = counts.metrics()
    assert metrics["seconds_left"] == pytest.approx(30.0, rel=0.2)
    assert metrics["machine/one/episodes_per_second"] == pytest.approx(0.8, rel=0.2)
    assert metrics["machine/two/episodes_per_second"] == pytest.approx(0.2, rel=0.2)
    assert counts.note().startswith("bad 0.25, one 0.")
