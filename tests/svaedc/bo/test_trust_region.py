import itertools
import math

import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st

from svaedc.bo.trust_region import FIRST_LENGTH, LARGEST_LENGTH, SMALLEST_LENGTH, SUCCESSES, TrustRegion

RISING = list(itertools.accumulate([1.0] * 30))


def after(*f, dimensions=3):
    return TrustRegion.after(f, dimensions)


def test_box_begins_with_random_trials_that_are_neither_success_nor_failure():
    assert after().begins
    assert after(1.0).begins
    region = after(1.0, 2.0)
    assert not region.begins
    assert (region.length, region.successes, region.failures) == (FIRST_LENGTH, 0, 0)


def test_box_doubles_after_successes_in_a_row_up_to_the_largest():
    assert after(*RISING[: 2 + SUCCESSES - 1]).length == FIRST_LENGTH
    assert after(*RISING[: 2 + SUCCESSES]).length == 2 * FIRST_LENGTH
    assert after(*RISING).length == LARGEST_LENGTH


def test_box_halves_after_as_many_failures_as_there_are_dimensions_and_at_least_four():
    for dimensions, patience in ((3, 4), (7, 7)):
        flat = [0.0] * (2 + patience)
        assert after(*flat[:-1], dimensions=dimensions).length == FIRST_LENGTH
        assert after(*flat, dimensions=dimensions).length == FIRST_LENGTH / 2


def test_one_success_forgives_the_failures_before_it():
    assert after(0.0, 0.0, *[0.0] * 3, 1.0, *[1.0] * 3).length == FIRST_LENGTH


def test_gain_within_rounding_is_no_success():
    region = after(1.0, 1.0, 1.0005)
    assert (region.successes, region.failures, region.best) == (0, 1, 1.0005)


def test_box_that_has_become_too_small_is_left_and_its_trials_forgotten():
    halvings = math.ceil(math.log2(FIRST_LENGTH / SMALLEST_LENGTH))
    last = 2 + 4 * halvings
    assert not after(*[0.0] * (last - 1)).begins
    region = after(*[0.0] * last)
    assert region.begins
    assert (region.first, region.trials, region.best, region.length) == (last, 0, -math.inf, FIRST_LENGTH)
    assert after(*[0.0] * last, -5.0, -4.0, -3.0).best == -3.0


@given(st.lists(st.floats(-5, 5), max_size=80), st.integers(0, 80))
def test_state_after_a_run_is_that_after_its_halves(f, cut):
    state = TrustRegion.after(f[:cut], 2)
    for each in f[cut:]:
        state = state.then(each)
    assert state == TrustRegion.after(f, 2)
    assert SMALLEST_LENGTH <= state.length <= LARGEST_LENGTH


def test_box_is_longer_where_the_objective_changes_slowly_and_keeps_its_volume():
    center = torch.tensor([0.5, 0.5], dtype=torch.float64)
    low, high = TrustRegion(2, length=0.2).box(center, torch.tensor([0.5, 2.0], dtype=torch.float64))
    assert (high - low).tolist() == pytest.approx([0.1, 0.4])
    torch.testing.assert_close((low + high) / 2, center)


def test_box_ends_at_the_unit_cube():
    center = torch.tensor([0.0, 0.9], dtype=torch.float64)
    low, high = TrustRegion(2).box(center, torch.ones(2, dtype=torch.float64))
    assert (low.tolist(), high.tolist()) == ([0.0, pytest.approx(0.5)], [pytest.approx(0.4), 1.0])
