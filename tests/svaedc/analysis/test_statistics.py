"""Intervals of means and shares against SciPy's and what they promise."""

import math

import numpy as np
import pytest
from scipy import stats

from svaedc.analysis.statistics import Estimate, bootstrap, proportion, share, student_t


def test_student_t_interval_is_that_of_scipy():
    values = np.random.default_rng(1).normal(size=12)
    ours = student_t(values, 0.9)
    low, high = stats.t.interval(0.9, 11, loc=values.mean(), scale=stats.sem(values))
    assert (ours.mean, ours.low, ours.high) == pytest.approx((values.mean(), low, high))


def test_bootstrap_interval_is_that_of_scipy_up_to_its_own_noise():
    values = np.random.default_rng(2).exponential(size=(40, 1))
    (ours,) = bootstrap(values, 0.9, np.random.default_rng(3))
    # As many standard errors out as Student's t with divisor n - 1.
    level = 1 - 2 * stats.norm.cdf(-stats.t.ppf(0.95, 39) * math.sqrt(40 / 39))
    theirs = stats.bootstrap(
        (values[:, 0],), np.mean, confidence_level=level, method="percentile", rng=np.random.default_rng(4)
    ).confidence_interval
    assert ours.mean == pytest.approx(values.mean())
    assert (ours.low, ours.high) == pytest.approx((theirs.low, theirs.high), abs=0.02)


@pytest.mark.parametrize("n", [5, 10, 50])
def test_bootstrap_interval_holds_the_truth_as_often_as_it_says(n):
    # Each column is a comparison of its own, whose true difference is 0.
    found = bootstrap(np.random.default_rng(n).normal(size=(n, 2_000)), 0.9, np.random.default_rng(0))
    assert np.mean([each.low <= 0 <= each.high for each in found]) == pytest.approx(0.9, abs=0.03)


def test_a_share_of_runs_has_the_exact_binomial_interval():
    theirs = stats.binomtest(4, 5).proportion_ci(0.9, method="exact")
    ours = proportion(np.array([True, True, False, True, True]), 0.9)
    assert (ours.mean, ours.low, ours.high) == pytest.approx((0.8, theirs.low, theirs.high))
    always = proportion(np.ones(5, dtype=bool), 0.9)
    assert (always.mean, always.high) == (1, 1)
    assert always.low == pytest.approx(0.05 ** (1 / 5))
    assert math.isnan(proportion(np.zeros(0, dtype=bool), 0.9).mean)


def test_an_interval_of_shares_stays_between_0_and_1():
    found = share(np.array([0.0, 0.0, 0.0, 0.1]), 0.9)
    assert (found.mean, found.low) == (0.025, 0)
    assert share(np.array([1.0, 1.0, 0.9]), 0.9).high == 1


def test_bootstrap_of_equal_values_has_no_width():
    assert (
        bootstrap(np.full((5, 2), 0.25), 0.9, np.random.default_rng(0)) == (Estimate(0.25, 0.25, 0.25),) * 2
    )


@pytest.mark.parametrize("values", [[], [1.5], [1.5, math.nan]])
def test_too_few_values_have_a_mean_at_most_and_no_interval(values):
    for estimate in (
        student_t(np.array(values), 0.9),
        *bootstrap(np.array(values)[:1].reshape(-1, 1), 0.9, np.random.default_rng(0)),
    ):
        assert math.isnan(estimate.low)
        assert math.isnan(estimate.high)
        assert estimate.mean == 1.5 if values else math.isnan(estimate.mean)
