"""The order of episodes is a function of (seed, update) and is shared out evenly."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from svaedc.data.samplers import ALONE, STRATA, Balanced, WorkerRank, batches

SEED = (0, 0)


def test_a_pass_shows_every_episode_once():
    seen = np.concatenate(list(batches(96, 32, ALONE, SEED, range(3))))
    assert sorted(seen) == list(range(96))


def test_passes_differ():
    first, second = batches(32, 32, ALONE, SEED, range(2))
    assert sorted(first) == sorted(second)
    assert list(first) != list(second)


@given(st.integers(1, 30), st.integers(0, 30))
def test_batches_from_the_middle_are_those_of_the_whole(count, start):
    whole = list(batches(97, 16, ALONE, SEED, range(60)))
    part = list(batches(97, 16, ALONE, SEED, range(start, start + count)))
    for expected, found in zip(whole[start:], part, strict=False):
        np.testing.assert_array_equal(found, expected)


@given(st.integers(1, 5), st.integers(5, 200), st.integers(1, 64))
def test_workers_get_equal_disjoint_shares(world, count, batch_size):
    shares = [
        list(batches(count, batch_size, WorkerRank(rank, world), SEED, range(7))) for rank in range(world)
    ]
    for per_update in zip(*shares, strict=True):
        assert len({len(share) for share in per_update}) == 1
        together = np.concatenate(per_update)
        assert len(set(together.tolist())) == len(together) > 0


def test_two_workers_together_see_what_one_sees_alone():
    alone = list(batches(100, 32, ALONE, SEED, range(3)))
    shared = zip(*(batches(100, 32, WorkerRank(rank, 2), SEED, range(3)) for rank in range(2)), strict=True)
    for whole, parts in zip(alone, shared, strict=True):
        np.testing.assert_array_equal(np.concatenate(parts), whole)


def test_a_dataset_smaller_than_a_batch_is_one_batch():
    assert [len(batch) for batch in batches(5, 32, ALONE, SEED, range(2))] == [5, 5]


def test_fewer_episodes_than_workers_are_refused():
    with pytest.raises(ValueError, match="3 workers need at least as many training episodes, got 2"):
        next(batches(2, 32, WorkerRank(0, 3), SEED, range(1)))


@given(
    st.lists(st.floats(0.0, 1.0, width=32), min_size=1, max_size=300),
    st.integers(0, 2**31),
)
def test_balanced_passes_show_every_stratum_equally_often_and_none_of_its_episodes_much_more(values, seed):
    values = np.array(values, np.float32)
    order = Balanced(values)(len(values), np.random.default_rng(seed))
    assert len(order) == len(values)
    edges = np.linspace(values.min(), values.max(), STRATA + 1)[1:-1]
    strata = np.digitize(values, edges)
    shown = [np.sum(strata[order] == each) for each in np.unique(strata)]
    assert max(shown) - min(shown) <= 1
    for each in np.unique(strata):
        times = np.bincount(order, minlength=len(values))[strata == each]
        assert times.max() - times.min() <= 1


def test_batches_take_the_order_they_are_given_the_same_whatever_the_start():
    order = Balanced(np.linspace(0.0, 1.0, 97, dtype=np.float32) ** 8)
    whole = list(batches(97, 16, ALONE, SEED, range(20), order))
    part = list(batches(97, 16, ALONE, SEED, range(7, 20), order))
    for expected, found in zip(whole[7:], part, strict=True):
        np.testing.assert_array_equal(found, expected)
    seen = np.concatenate(whole)
    assert np.mean(seen > 90) > 2.0 * np.mean(np.arange(97) > 90)


def test_values_that_are_not_finite_have_no_stratum():
    with pytest.raises(ValueError, match="finite values, got NaN"):
        Balanced(np.array([0.0, np.nan], np.float32))


@pytest.mark.parametrize("count", [3, 5])
def test_a_pass_over_another_number_of_episodes_than_there_are_values_is_refused(count):
    order = Balanced(np.array([0.0, 0.5, 0.5, 1.0], np.float32))
    with pytest.raises(ValueError, match=f"sampling of {count} episodes needs as many values, got 4"):
        next(batches(count, 2, ALONE, SEED, range(1), order))


def test_a_rank_outside_the_world_is_refused():
    with pytest.raises(ValueError, match="got rank 2 of 2"):
        WorkerRank(2, 2)
