"""Verdicts of comparisons whose answer is known because they were made."""

import math

import numpy as np
import pytest

from svaedc.analysis.aggregation import summarize
from svaedc.analysis.statistics import holm, sign_flip
from svaedc.analysis.summary import Reporting, Row
from svaedc.analysis.verdict import judge, leader, least_runs, sentences, verdict

NOISE = np.linspace(-0.05, 0.05, 10)


def summary(ends: dict[str, list[float]]):
    """A comparison whose runs have one trial each, of these objectives; seeds count from 0."""
    rows = [
        Row(method, run, 0, f, success=False) for method, all_f in ends.items() for run, f in enumerate(all_f)
    ]
    return summarize(rows, Reporting(initial=0), np.random.default_rng(0))


def around(middle: float, runs: int = 10, sign: int = 1) -> list[float]:
    return (middle + sign * NOISE[:runs]).tolist()


def judgement(found, method: str, baseline: str) -> str:
    return next(
        judge(found, each) for each in found.differences if (each.method, each.baseline) == (method, baseline)
    )


def test_a_difference_that_is_told_is_a_sentence_with_its_evidence():
    found = summary({"ours": around(0.62, sign=-1), "random": around(0.5)})
    assert leader(found) == "ours"
    assert verdict(found) == "ours ends highest after 1 trial: it is better than random."
    [sentence] = sentences(found, "ours")
    assert sentence == "ours ends 0.12 above random (90 % interval 0.08 to 0.16, 10 paired runs): better."
    [mirrored] = sentences(found, "random")
    assert mirrored == "random ends 0.12 below ours (90 % interval 0.08 to 0.16, 10 paired runs): worse."


def test_what_cannot_be_told_apart_is_called_so():
    found = summary({"ours": around(0.51), "se": around(0.5, sign=-1), "random": around(0.1)})
    assert verdict(found) == (
        "ours ends highest after 1 trial: it is better than random; it cannot be told apart from se."
    )
    assert "paired runs): cannot be told apart." in next(
        text for text in sentences(found, "ours") if "se" in text
    )


def test_an_interval_without_zero_tells_nothing_that_the_correction_does_not():
    """Nine of ten runs differ one way: p is 0.02 alone, and 0.13 among six."""
    ours = [0.0] * 10
    baselines = {f"b{i}": [0.1, *[-0.1] * 9] for i in range(6)}
    alone, among = summary({"ours": ours, "b0": baselines["b0"]}), summary({"ours": ours, **baselines})
    assert judgement(alone, "ours", "b0") == "better"
    assert judgement(among, "ours", "b0") == "not told apart"
    [first, *_] = sentences(among, "ours")
    assert first.endswith("10 paired runs): cannot be told apart (p = 0.13, corrected for 6 comparisons).")


@pytest.mark.parametrize("runs", [1, 2, 4])
def test_too_few_runs_tell_nothing_however_far_apart_they_are(runs):
    found = summary({"ours": around(100.0, runs), "random": around(0.0, runs)})
    assert judgement(found, "ours", "random") == "too few runs"
    assert "too few runs to tell it from random (at least 5 in common are needed)" in verdict(found)
    [sentence] = sentences(found, "ours")
    assert sentence.startswith(
        "ours ends 100 above random (1 paired run): too few" if runs == 1 else "ours ends 100 above"
    )
    assert "nan" not in sentence


@pytest.mark.parametrize("baselines", range(1, 9))
def test_the_least_runs_are_the_fewest_whose_smallest_p_passes_the_correction(baselines):
    least = least_runs(baselines, 0.9)

    def smallest(runs: int) -> float:
        p = sign_flip(np.ones((runs, 1)), np.random.default_rng(0))
        return float(holm(np.tile(p, (baselines, 1))).max())

    assert smallest(least) <= 0.1 < smallest(least - 1)


def test_failed_trials_and_absent_runs_are_named_and_no_number_is_nan():
    found = summary({"ours": around(0.6), "se": [math.nan, *around(0.3)[1:]], "dead": [math.nan] * 10})
    assert verdict(found) == (
        "ours ends highest after 1 trial, but it cannot be compared with dead and se "
        "(runs without an objective)."
    )
    assert next(sentences(found, "ours")) == (
        "ours and dead cannot be compared: in a run of both, one has no objective."
    )
    rows = [Row("ours", 0, 0, 0.5, success=False), Row("se", 1, 0, 0.1, success=False)]
    apart = summarize(rows, Reporting(initial=0), np.random.default_rng(0))
    assert verdict(apart) == "ours ends highest after 1 trial, but it has no whole run in common with se."


def test_without_an_objective_another_method_or_a_difference_there_is_no_winner():
    assert verdict(summary({"a": [math.nan], "b": [math.nan]})) == (
        "No method has an objective after 1 trial: nothing can be compared."
    )
    assert verdict(summary({"a": [0.5]})) == "a is the only method: there is nothing to compare it with."
    level = summary({"a": around(0.5), "b": around(0.5), "c": around(0.1)})
    assert verdict(level) == "a and b end equally high after 1 trial: nothing tells them apart."
    assert next(sentences(level, "a")).startswith(
        "a ends level with b (90 % interval 0.00 to 0.00, 10 paired runs)"
    )
