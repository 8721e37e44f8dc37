import itertools
from dataclasses import astuple

import numpy as np
import pytest

from svaedc.bo import methods
from svaedc.bo.loop import Outcome, trials
from tests.svaedc.bo.fake_latents import problem, quadratic

INITIAL = np.array([[0.5, 0.5], [0.9, 0.1]], dtype=np.float32)


def rng_for(index):
    return np.random.default_rng([7, index])


def evaluate(x):
    return Outcome(quadratic(x), y=0.25, success=quadratic(x) > 0.9)


def fails_on_the_left(x):
    return Outcome(float("nan"), float("nan"), True, "diverged") if x[0] < 0.4 else evaluate(x)


def run(name="se", evaluate=evaluate, count=5, earlier=(), initial=INITIAL, clock=lambda: 0.0):
    method = methods.build(name, problem(2, 80, seed=1))
    return trials(method, evaluate, initial, count, rng_for, clock, earlier)


def facts(records):
    """Everything in the records as comparable bytes, NaN included."""
    return [
        repr([part.tobytes() if isinstance(part, np.ndarray) else part for part in astuple(t)])
        for t in records
    ]


def test_run_starts_with_the_shared_controllers_and_then_follows_the_method():
    records = list(run(count=3))
    assert [trial.index for trial in records] == [0, 1, 2, 3, 4]
    np.testing.assert_array_equal([trial.x for trial in records[:2]], INITIAL)
    pool = problem(2, 80, seed=1).pool
    assert all((pool == trial.x).all(axis=1).any() for trial in records[2:])


def test_records_say_what_the_evaluation_showed():
    for trial in run(count=6):
        assert trial.f == quadratic(trial.x)
        assert (trial.y, trial.success, trial.status, trial.stop) == (0.25, trial.f > 0.9, "ok", "")


@pytest.mark.parametrize("name", ["random", "svae-dc", "turbo"])
@pytest.mark.parametrize("done", [0, 1, 2, 4])
def test_interrupted_and_resumed_run_equals_an_uninterrupted_one(name, done):
    whole = list(run(name, count=3))
    before = list(itertools.islice(run(name, count=3), done))
    assert facts(before + list(run(name, count=3, earlier=before))) == facts(whole)


def test_run_with_failures_resumes_identically():
    whole = list(run(evaluate=fails_on_the_left))
    assert "failed" in {trial.status for trial in whole}
    before = whole[:5]
    assert facts(before + list(run(evaluate=fails_on_the_left, earlier=before))) == facts(whole)


def test_longer_run_begins_with_the_shorter_one():
    assert facts(list(run(count=6))[:4]) == facts(run(count=2))


def test_complete_run_has_nothing_left_to_do():
    assert list(run(earlier=list(run()))) == []


def test_best_is_the_largest_objective_so_far():
    records = list(run("random", count=10))
    np.testing.assert_array_equal([t.best for t in records], np.maximum.accumulate([t.f for t in records]))


def test_failed_trial_is_kept_in_the_record_and_its_controller_never_tried_again():
    records = list(run(evaluate=fails_on_the_left, count=12))
    failed = [trial for trial in records if trial.status == "failed"]
    assert len(failed) >= 2
    for trial in failed:
        assert np.isnan(trial.f)
        assert (trial.success, trial.stop) == (False, "diverged")
    assert len({trial.x.tobytes() for trial in records}) == len(records)
    assert all(np.isfinite(trial.best) for trial in records)


@pytest.mark.parametrize("impossible", [float("inf"), float("-inf")])
def test_an_infinite_objective_is_a_failed_trial_and_the_run_goes_on(impossible):
    def endless_on_the_left(x):
        return Outcome(impossible, 0.5, True) if x[0] < 0.4 else evaluate(x)

    records = list(run(evaluate=endless_on_the_left, count=12))
    failed = [trial for trial in records if trial.x[0] < 0.4]
    assert failed
    assert {(trial.status, trial.success, repr(trial.f)) for trial in failed} == {("failed", False, "nan")}
    assert all(np.isfinite(trial.best) for trial in records)


def test_best_is_unknown_until_there_is_an_objective():
    first_fails = np.array([[0.1, 0.5], [0.9, 0.1]], dtype=np.float32)
    records = list(run(evaluate=fails_on_the_left, initial=first_fails, count=0))
    assert np.isnan(records[0].best)
    assert records[1].best == records[1].f


def test_nothing_is_evaluated_before_it_is_asked_for():
    tried = []

    def counting(x):
        tried.append(x)
        return evaluate(x)

    generator = run(evaluate=counting)
    assert tried == []
    next(generator)
    assert len(tried) == 1


def test_evaluation_cannot_change_the_record():
    def vandal(x):
        outcome = evaluate(x)
        x[:] = 0
        return outcome

    assert facts(run(evaluate=vandal)) == facts(run())


def test_seconds_are_those_of_the_clock():
    ticks = itertools.count(step=0.5)
    assert [trial.seconds for trial in run("random", clock=lambda: next(ticks))] == [0.5] * 7


def test_records_of_another_run_are_refused():
    records = list(run())
    with pytest.raises(ValueError, match="without a gap, got 1 at 0"):
        list(run(earlier=records[1:]))
    with pytest.raises(ValueError, match="trial 1 must have tried the shared controller"):
        list(run(earlier=records, initial=INITIAL[[0, 0]]))
