"""What is expected of a job, checked on jobs whose whole cost is known."""

import json
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.collection.forecast import Forecast, Prediction, forecast, pilot_of
from workers.collection.shard import ShardReport
from workers.dataset.shards import Shard


def reports(costs, episodes=16):
    """Shards that cost so many seconds each; CPU time is half of it, bytes a thousand times."""
    return [
        ShardReport(
            shard=Shard(number * episodes, (number + 1) * episodes),
            badness=cost / 100,
            diverged=0,
            stopped=0,
            best=0.0,
            size=int(1000 * cost),
            rollout_seconds=0.4 * cost,
            storage_seconds=0.1 * cost,
            seconds=cost,
            machine="here",
        )
        for number, cost in enumerate(costs)
    ]


def test_equal_shards_foretell_the_job_exactly():
    found = forecast(reports([10.0] * 4), 160, actors=2)
    assert found.hours.value == pytest.approx(10 * 10 / 2 / 3600)
    assert found.core_hours.value == pytest.approx(10 * 10 / 2 / 3600)
    assert found.size.value == pytest.approx(100_000)
    assert found.badness.value == pytest.approx(0.1)
    estimates = (found.hours, found.core_hours, found.size, found.badness)
    assert [estimate.margin for estimate in estimates] == pytest.approx([0.0] * 4)


def test_a_job_that_is_done_is_certain():
    found = forecast(reports([8.0, 12.0, 13.0]), 48, actors=1)
    assert found.hours == Prediction(33.0 * (1 / 3600), 0.0)


def test_partial_shards_count_by_their_episodes():
    short = reports([5.0], episodes=8)
    whole = reports([10.0, 10.0])
    found = forecast([*whole, *short], 400, actors=1)
    assert found.hours.value == pytest.approx(250 / 3600)


def test_the_interval_holds_the_truth_as_often_as_it_says():
    """500 jobs of 40 shards with normal costs, each foretold from its first five."""
    rng = np.random.default_rng(0)
    held = 0
    for _ in range(500):
        costs = np.abs(rng.normal(30.0, 4.0, 40)).tolist()
        found = forecast(reports(costs[:5]), 640, actors=1)
        held += abs(found.hours.value * 3600 - sum(costs)) <= found.hours.margin * 3600
    assert 0.86 <= held / 500 <= 0.94


def test_a_forecast_survives_json():
    found = forecast(reports([8.0, 12.0, 13.0]), 480, actors=3)
    assert Forecast.from_json(json.loads(json.dumps(found.to_json()))) == found


@pytest.mark.parametrize("values", [{}, {"episodes": 3, "actors": 1}, {"unknown": 1}])
def test_what_is_no_forecast_is_refused(values):
    with pytest.raises(ValueError, match="no forecast"):
        Forecast.from_json(values)


@pytest.mark.parametrize(("costs", "episodes"), [([10.0], 160), ([10.0, 11.0], 16)])
def test_a_pilot_of_one_shard_or_beyond_the_job_is_refused(costs, episodes):
    with pytest.raises(ValueError, match="at least 2 shards of the job"):
        forecast(reports(costs), episodes, actors=1)


@given(
    sizes=st.lists(st.integers(1, 256), min_size=1, max_size=40),
    actors=st.integers(1, 16),
)
def test_a_pilot_is_a_tenth_of_the_job_at_most_and_cuts_no_other_episodes(sizes, actors):
    starts = np.cumsum([0, *sizes]).tolist()
    missing = [Shard(start, stop) for start, stop in pairwise(starts)]
    pilot = pilot_of(missing, actors)
    assert sum(shard.episodes for shard in pilot) <= sum(sizes) / 10
    assert (len(pilot) >= 2) == (sum(sizes) >= 20)
    held = [index for shard in pilot for index in range(shard.start, shard.stop)]
    assert held == sorted(set(held))
    assert all(any(one.start <= each.start and each.stop <= one.stop for one in missing) for each in pilot)


def test_the_pilot_of_a_large_job_is_whole_shards():
    missing = [Shard(start, start + 256) for start in range(0, 500_000, 256)]
    assert pilot_of(missing, 3) == missing[:6]
