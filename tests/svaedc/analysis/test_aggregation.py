"""Summaries of hand-made comparisons, whose answers are known."""

import itertools
import json
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from svaedc.analysis.aggregation import best_of_runs, summarize
from svaedc.analysis.statistics import holm, sign_flip, student_t
from svaedc.analysis.summary import Reporting, Row

OBJECTIVE = st.one_of(st.floats(-2, 2, width=32), st.just(math.nan))


def rows(method, f, success_above=0.5):
    return [
        Row(method, run, trial, float(value), bool(value > success_above))
        for run, values in enumerate(f)
        for trial, value in enumerate(values)
    ]


def two_methods(runs=8, trials=6):
    f = np.random.default_rng(0).normal(size=(2, runs, trials))
    return f, rows("ours", f[0]) + rows("theirs", f[1])


def summary(given, reporting=None, seed=0):
    return summarize(given, reporting or Reporting(broken_below=-0.5), np.random.default_rng(seed))


def test_a_difference_mirrors_its_reverse_and_no_other_method_changes_it():
    rng = np.random.default_rng(0)
    two = [row for name in ("one", "other") for row in rows(name, rng.normal(size=(6, 4)))]
    more = [*two, *rows("another", rng.normal(size=(6, 4)))]
    pairs = {(each.method, each.baseline): each for each in summary(two, Reporting()).differences}
    ours, theirs = pairs["one", "other"].best[-1], pairs["other", "one"].best[-1]
    assert (ours.low, ours.high) == pytest.approx((-theirs.high, -theirs.low))
    assert pairs["one", "other"].p_objective == pairs["other", "one"].p_objective
    among = {(each.method, each.baseline): each for each in summary(more, Reporting()).differences}
    assert among["one", "other"].best == pairs["one", "other"].best


def test_best_so_far_is_averaged_over_runs_at_each_trial():
    f, given = two_methods()
    ours = summary(given).methods["ours"]
    for trial, estimate in enumerate(ours.best):
        assert estimate == student_t(f[0][:, : trial + 1].max(axis=1), 0.9)


def test_initial_trials_are_no_merit_of_the_method():
    f = np.array([[-9.0, -9.0, 0.0, 1.0], [-9.0, -9.0, 0.25, 0.75]])
    ours = summary(rows("ours", f)).methods["ours"]
    assert ours.objective.mean == 0.5
    assert ours.broken_trials.mean == 0
    assert ours.successful_trials.mean == 0.5
    assert ours.successful_runs.mean == 1


def test_broken_and_failed_trials_are_counted_apart():
    f = np.array([[0.0, 0.0, -0.6, -0.4, math.nan, -3.0], [0.0] * 6])
    ours = summary(rows("ours", f)).methods["ours"]
    assert ours.broken_trials.mean == pytest.approx((2 / 3 + 0) / 2)
    assert ours.failed_trials.mean == pytest.approx((1 / 4 + 0) / 2)
    lenient = summary(rows("ours", f), Reporting(broken_below=-1.0)).methods["ours"]
    assert lenient.broken_trials.mean == pytest.approx((1 / 3 + 0) / 2)
    assert math.isnan(summary(rows("ours", f), Reporting()).methods["ours"].broken_trials.mean)


def test_trials_needed_are_counted_from_the_first_suggestion():
    f = np.zeros((5, 6))
    f[0, 2] = f[1, 4] = f[2, 0] = f[3, 5] = 1.0
    found = summary(rows("ours", f)).methods["ours"].first_success
    # Run 2 succeeds among the shared trials; run 4 never does, and counts as one trial more than it had.
    assert (found.reached, found.median) == (4, 3.0)
    assert found.mean == student_t(np.array([1.0, 3.0, 0.0, 4.0, 5.0]), 0.9)


def test_threshold_nobody_reaches_has_no_median_and_says_so():
    found = summary(rows("ours", np.zeros((4, 6)))).methods["ours"]
    assert found.first_success.reached == 0
    assert math.isnan(found.first_success.median)
    assert found.successful_runs.mean == 0
    assert json.loads(json.dumps(summary(rows("ours", np.zeros((4, 6)))).as_json()))["methods"]["ours"][
        "first_success"
    ] == {"reached": 0, "median": None, "mean": {"mean": 5.0, "low": 5.0, "high": 5.0}}


def test_median_needs_more_than_half_of_the_runs():
    f = np.zeros((4, 6))
    f[:2, 3] = 1.0
    assert math.isnan(summary(rows("ours", f)).methods["ours"].first_success.median)
    f[2, 5] = 1.0
    assert summary(rows("ours", f)).methods["ours"].first_success.median == 3.0


def test_p_values_are_corrected_for_the_number_of_baselines_at_each_trial():
    f = np.random.default_rng(0).normal(size=(3, 8, 4))
    given = [row for name, each in zip("abc", f, strict=True) for row in rows(name, each)]
    ours = [d for d in summary(given).differences if d.method == "a"]
    best = np.maximum.accumulate(f, axis=2)
    for trial in range(4):
        plain = [sign_flip(best[0] - best[i], np.random.default_rng(0))[trial] for i in (1, 2)]
        expected = holm(np.array(plain)[:, None])[:, 0]
        assert [d.p_best[trial] for d in ours] == pytest.approx(expected)


def test_reporting_and_tuning_seeds_are_told_apart_and_never_mixed():
    given = rows("ours", np.zeros((2, 3)))
    assert summary(given).purpose == "reporting"
    tuning = [Row(row.method, row.run + 1000, row.trial, row.f, row.success) for row in given]
    assert summary(tuning).purpose == "tuning"
    with pytest.raises(ValueError, match="got 0 to 1001"):
        summary(given + tuning)


def test_difference_is_paired_by_run():
    common = np.random.default_rng(0).normal(scale=100, size=(10, 5))
    ours, theirs = common + 0.5, common
    given = rows("ours", ours) + rows("theirs", theirs)
    (difference,) = [d for d in summary(given).differences if d.method == "ours"]
    assert difference.runs == 10
    for estimate in (*difference.best, difference.objective):
        assert (estimate.mean, estimate.low, estimate.high) == pytest.approx((0.5, 0.5, 0.5))


def test_difference_uses_only_the_runs_both_completed():
    f, _ = two_methods(runs=4)
    given = rows("ours", f[0]) + [row for row in rows("theirs", f[1]) if row.run != 2]
    (difference,) = [d for d in summary(given).differences if d.method == "ours"]
    kept = [0, 1, 3]
    assert difference.runs == 3
    assert difference.best[-1].mean == pytest.approx((f[0][kept].max(axis=1) - f[1][kept].max(axis=1)).mean())


def test_every_method_is_compared_with_every_other():
    f = np.zeros((2, 3))
    given = [row for name in ("a", "b", "c") for row in rows(name, f)]
    pairs = {(d.method, d.baseline) for d in summary(given).differences}
    assert pairs == {(a, b) for a in "abc" for b in "abc" if a != b}


def test_run_with_missing_trials_is_left_out_and_counted():
    f, given = two_methods(runs=3)
    given.remove(next(row for row in given if row.method == "ours" and row.run == 1 and row.trial == 5))
    ours = summary(given).methods["ours"]
    assert (ours.runs, ours.incomplete) == (2, 1)
    assert ours.best[0].mean == pytest.approx(f[0][[0, 2], 0].mean())


@settings(deadline=None, max_examples=30)
@given(arrays.arrays(float, (3, 5), elements=OBJECTIVE), st.randoms(use_true_random=False))
def test_summary_does_not_depend_on_the_order_of_the_rows(f, random):
    given = rows("ours", f) + rows("theirs", f[::-1])
    shuffled = list(given)
    random.shuffle(shuffled)
    assert summary(shuffled).as_json() == summary(given).as_json()


@settings(deadline=None, max_examples=30)
@given(arrays.arrays(float, (4, 6), elements=st.floats(-2, 2, width=32)))
def test_mean_of_best_so_far_never_falls(f):
    means = [estimate.mean for estimate in summary(rows("ours", f)).methods["ours"].best]
    assert all(later >= earlier - 1e-12 for earlier, later in itertools.pairwise(means))


@settings(deadline=None, max_examples=30)
@given(arrays.arrays(float, (3, 5), elements=OBJECTIVE))
def test_summary_is_strict_json_whatever_failed(f):
    text = json.dumps(summary(rows("ours", f) + rows("theirs", f)).as_json(), allow_nan=False)
    assert set(json.loads(text)) == {"trials", "purpose", "confidence", "methods", "differences"}


def test_failed_trials_are_counted_among_all_that_were_made_those_of_incomplete_runs_too():
    given = [
        *rows("ours", [[1.0, math.nan, 2.0], [math.nan, math.nan, math.nan]]),
        Row("ours", 2, 0, math.nan, False),
    ]
    ours = summary(given).methods["ours"]
    assert (ours.runs, ours.incomplete, ours.tried, ours.failed) == (2, 1, 7, 5)


def test_the_best_of_runs_are_what_the_summary_averages():
    f, given = two_methods()
    runs = best_of_runs([*given, Row("ours", 99, 0, 0.0, success=False)])
    np.testing.assert_array_equal(runs["ours"], np.maximum.accumulate(f[0], axis=1))
    means = [estimate.mean for estimate in summary(given).methods["theirs"].best]
    np.testing.assert_allclose(runs["theirs"].mean(axis=0), means)


def test_rows_that_contradict_each_other_are_refused():
    _, given = two_methods()
    with pytest.raises(ValueError, match="two of ours run 0 trial 0"):
        summary(given + given[:1])
    with pytest.raises(ValueError, match="no rows"):
        summary([])
