import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from svaedc.analysis.statistics import FLIPS, holm, sign_flip


def differences(runs, shift=0.0, seed=0):
    return np.random.default_rng(seed).normal(shift, 1.0, (runs, 2))


@pytest.mark.parametrize("runs", [2, 5, 13])
def test_p_value_of_few_runs_is_that_of_all_sign_patterns(runs):
    values = differences(runs, shift=0.5)
    ours = sign_flip(values, np.random.default_rng(0))
    for column, p in zip(values.T, ours, strict=True):
        means = [np.dot(signs, column) / runs for signs in itertools.product((-1, 1), repeat=runs)]
        assert p == pytest.approx(np.mean(np.abs(means) >= abs(column.mean()) - 1e-12))


def test_p_value_of_many_runs_is_that_of_scipy_up_to_its_own_noise():
    values = differences(40, shift=0.2)
    ours = sign_flip(values, np.random.default_rng(0))
    for column, p in zip(values.T, ours, strict=True):
        theirs = stats.permutation_test(
            (column,), np.mean, permutation_type="samples", n_resamples=9_999, rng=np.random.default_rng(1)
        )
        assert p == pytest.approx(theirs.pvalue, abs=0.02)


def test_certain_difference_has_the_smallest_p_value_and_no_difference_the_largest():
    assert sign_flip(np.ones((30, 1)), np.random.default_rng(0))[0] == pytest.approx(1 / (FLIPS + 1))
    assert sign_flip(np.zeros((30, 1)), np.random.default_rng(0))[0] == 1


@pytest.mark.parametrize("values", [np.empty((0, 1)), np.ones((1, 1)), np.array([[1.0], [np.nan], [2.0]])])
def test_too_few_or_unknown_differences_have_no_p_value(values):
    assert math.isnan(sign_flip(values, np.random.default_rng(0))[0])


@given(st.lists(st.floats(0, 1), min_size=1, max_size=6))
def test_holm_is_the_closed_test_of_bonferroni(p):
    ours = holm(np.array(p)[:, None])[:, 0]
    for index in range(len(p)):
        others = [i for i in range(len(p)) if i != index]
        sets = [(index, *rest) for n in range(len(p)) for rest in itertools.combinations(others, n)]
        assert ours[index] == pytest.approx(max(min(1, len(s) * min(p[i] for i in s)) for s in sets))


def test_holm_corrects_every_column_on_its_own_and_counts_only_known_tests():
    p = np.array([[0.01, 0.5], [np.nan, 0.01], [0.03, 0.01]])
    np.testing.assert_allclose(holm(p), [[0.02, 0.5], [np.nan, 0.03], [0.03, 0.03]])
