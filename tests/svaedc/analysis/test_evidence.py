"""Verdicts on claims, against comparisons whose answer is known because it was made."""

import math

import numpy as np
import pytest

from svaedc.analysis.aggregation import summarize
from svaedc.analysis.evidence import Claim, Evidence, FewerBroken, MedianGap, Steadier, Successes
from svaedc.analysis.paired_evidence import Gain, Like, NoBetter
from svaedc.analysis.summary import Reporting, Row

INITIAL = 2


def panel(ends: dict[str, list[float]], success_above: float = 0.5):
    """A comparison in which each run has two bad random trials and three equal ones of this objective."""
    rows = [
        Row(method, run, trial, f, f > success_above)
        for method, all_f in ends.items()
        for run, end in enumerate(all_f)
        for trial, f in enumerate([-1.0, -1.0, end, end, end])
    ]
    return summarize(rows, Reporting(initial=INITIAL), np.random.default_rng(0))


NOISE = np.linspace(-0.1, 0.1, 8)


def around(middle: float, spread: float) -> list[float]:
    return (middle + spread * NOISE).tolist()


PANELS = {
    "left": panel({"good": around(0.6, 1), "bad": around(0.2, -1), "twin": around(0.6, -1)}),
    "tight": panel({"good": around(0.6, 0.25)}),
    "other": panel({"good": around(0.6, 1.2)}),
}


@pytest.mark.parametrize(
    ("evidence", "verdict"),
    [
        (Gain("left", "good", "bad", 3), "holds"),
        (Gain("left", "bad", "good", 3), "does not hold"),
        (Gain("left", "good", "twin", 3), "open"),
        (Gain("left", "good", "bad", 3, high=1.0), "holds"),
        (Gain("left", "good", "bad", 3, high=0.4), "open"),
        (Gain("left", "good", "bad", 3, high=0.1), "does not hold"),
        (Gain("left", "good", "bad", 4), "not measured"),
        (Gain("left", "good", "absent", 3), "not measured"),
        (Gain("absent", "good", "bad", 3), "not measured"),
        (Like("left", "good", "twin", 3), "holds"),
        (Like("left", "good", "bad", 3), "does not hold"),
        (NoBetter("left", "good", "twin", 3), "holds"),
        (NoBetter("left", "bad", "good", 3), "holds"),
        (NoBetter("left", "good", "bad", 3), "does not hold"),
        (Successes("left", "good", "runs", 0.5, 1.0), "holds"),
        (Successes("left", "good", "runs", 0.0, 0.4), "does not hold"),
        (Successes("left", "bad", "trials", 0.0, 0.04), "holds"),
        (Successes("left", "absent", "runs", 0.0, 1.0), "not measured"),
        (MedianGap("left", "good", 1.0, 3, high=0.5), "holds"),
        (MedianGap("left", "good", 1.0, 3, high=0.3), "does not hold"),
        (MedianGap("left", "good", 1.0, 3, low=0.5), "does not hold"),
        (MedianGap("left", "good", 1.0, 4), "not measured"),
        (MedianGap("left", "absent", 1.0, 3), "not measured"),
        (Steadier("tight", "left", "good"), "holds"),
        (Steadier("left", "tight", "good"), "does not hold"),
        (Steadier("left", "other", "good"), "open"),
        (Steadier("tight", "left", "bad"), "not measured"),
        (Steadier("tight", "absent", "good"), "not measured"),
    ],
)
def test_a_verdict_is_what_the_comparison_was_made_to_say(evidence, verdict):
    assert isinstance(evidence, Evidence)
    assert evidence.finding(PANELS, INITIAL).verdict == verdict


def test_a_gain_is_the_mean_of_the_paired_differences_with_its_interval():
    found = Gain("left", "good", "bad", 1).finding(PANELS, INITIAL)
    assert found.runs == 8
    assert found.value.mean == pytest.approx(np.mean(0.4 + 2 * NOISE))
    assert found.value.low < 0.4 < found.value.high


def test_the_shares_are_those_of_runs_and_of_suggested_trials():
    runs = panel({"half": [1.0, 1.0, 0.0, 0.0]})
    among_runs = Successes("it", "half", "runs", 0.5, 0.5).finding({"it": runs}, INITIAL)
    among_trials = Successes("it", "half", "trials", 0.5, 0.5).finding({"it": runs}, INITIAL)
    assert (among_runs.value.mean, among_trials.value.mean) == (0.5, 0.5)
    assert among_runs.runs == 4


def test_a_quarter_of_the_width_is_a_ratio_of_a_quarter_with_the_interval_of_a_ratio():
    found = Steadier("tight", "left", "good").finding(PANELS, INITIAL)
    assert found.value.mean == pytest.approx(0.25)
    # The table of F for 7 and 7 degrees of freedom: 3.787 is exceeded by 5 %.
    assert found.value.high == pytest.approx(0.25 * math.sqrt(3.787), rel=1e-3)
    assert found.value.low == pytest.approx(0.25 / math.sqrt(3.787), rel=1e-3)


def test_the_gap_is_that_of_the_median_run_and_not_of_the_mean():
    runs = panel({"mostly": [0.5, 0.5, 10.0]})
    found = MedianGap("it", "mostly", 12.0, 3, low=1.0).finding({"it": runs}, INITIAL)
    assert (found.value.mean, found.runs, found.verdict) == (11.5, 3, "holds")
    before_any = MedianGap("it", "mostly", 12.0, 0, low=1.0).finding({"it": runs}, INITIAL)
    assert before_any.value.mean == 13.0


def test_one_run_leaves_a_gain_open():
    alone = {"it": panel({"good": [0.9], "bad": [0.1]})}
    assert Gain("it", "good", "bad", 3).finding(alone, INITIAL).verdict == "open"
    assert Like("it", "good", "bad", 3).finding(alone, INITIAL).verdict == "open"


def test_every_measure_says_what_it_is_about():
    assert Gain("left", "good", "bad", 3, high=2.5).measure == "good − bad ≤ 2.5, best after 3"
    assert Like("left", "good", "bad", 3).measure == "good − bad ≈ 0, best after 3"
    assert NoBetter("left", "good", "bad", 3).measure == "good − bad ≤ 0, best after 3"
    assert Successes("left", "good", "runs", 0.0, 1.0).measure == "good, share of runs with a success"
    assert MedianGap("left", "good", 12.0, 3, low=2.5).measure == "good, median gap to 12 ≥ 2.5, best after 3"
    assert Steadier("tight", "left", "good").measure == "good, width of the last interval, tight / left"


def test_a_claim_without_evidence_is_refused():
    with pytest.raises(ValueError, match="at least one piece of evidence, got none for 'it is so'"):
        Claim("it is so", "section 1", ())


def test_shares_of_broken_trials_are_held_against_each_other():
    rows = [
        Row(method, run, trial, f, success=False)
        for method, broken in {"careful": 2, "wild": 6, "never": 0}.items()
        for run in range(3)
        for trial, f in enumerate([0.0, 0.0, *[-2.0] * broken, *[0.0] * (8 - broken)])
    ]
    reporting = Reporting(initial=INITIAL, broken_below=-1.0)
    panels = {"it": summarize(rows, reporting, np.random.default_rng(0))}
    fewer = FewerBroken("it", "careful", "wild", 0.5).finding(panels, INITIAL)
    assert (fewer.value.mean, fewer.runs, fewer.verdict) == (pytest.approx(1 / 3), 3, "holds")
    assert FewerBroken("it", "careful", "wild", 0.3).finding(panels, INITIAL).verdict == "does not hold"
    for method, baseline in (("careful", "never"), ("careful", "absent"), ("absent", "wild")):
        assert FewerBroken("it", method, baseline, 1.0).finding(panels, INITIAL).verdict == "not measured"
    assert FewerBroken("it", "careful", "wild", 2 / 3).measure == "careful / wild, broken trials ≤ 0.67"
