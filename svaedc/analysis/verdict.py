"""What a comparison says in plain words: which method ends highest, and from which others it can be told."""

import math
from collections.abc import Iterator
from itertools import groupby
from typing import Final, Literal

from svaedc.analysis.statistics import Estimate
from svaedc.analysis.summary import Difference, MethodSummary, Summary
from svaedc.analysis.words import enumeration, places, quantity

Judgement = Literal["better", "worse", "not told apart", "too few runs", "no objective", "no common run"]

_PHRASES: Final[dict[Judgement, str]] = {
    "better": "it is better than {}",
    "worse": "over the runs of both it is worse than {}",
    "not told apart": "it cannot be told apart from {}",
    "too few runs": "there are too few runs to tell it from {} (at least {least} in common are needed)",
    "no objective": "it cannot be compared with {} (runs without an objective)",
    "no common run": "it has no whole run in common with {}",
}
"""This is how the judgements follow each other in a sentence, each with the methods it is about."""


def leader(summary: Summary) -> str | None:
    """The method whose whole runs end highest on average; None where no method has an objective."""
    ends = {name: method.best[-1].mean for name, method in summary.methods.items() if method.runs}
    known = {name: end for name, end in ends.items() if not math.isnan(end)}
    return max(known, key=known.__getitem__) if known else None


def verdict(summary: Summary) -> str:
    """Tell in one sentence which method ends highest, and from which others these runs can tell it."""
    first, trials = leader(summary), quantity(summary.trials, "trial")
    if first is None:
        return f"No method has an objective after {trials}: nothing can be compared."
    differences = _differences(summary, first)
    if not differences:
        return f"{first} is the only method: there is nothing to compare it with."
    tied = [name for name, method in summary.methods.items() if _is_level(method, summary.methods[first])]
    if len(tied) > 1:
        return f"{enumeration(tied)} end equally high after {trials}: nothing tells them apart."
    order, least = list(_PHRASES), least_runs(_tests(summary, first), summary.confidence)
    judged = sorted(differences, key=lambda each: order.index(judge(summary, each)))
    parts = [
        _PHRASES[judgement].format(enumeration([each.baseline for each in group]), least=least)
        for judgement, group in groupby(judged, key=lambda each: judge(summary, each))
    ]
    link = ":" if judge(summary, judged[0]) == "better" else ", but"
    return f"{first} ends highest after {trials}{link} {'; '.join(parts)}."


def sentences(summary: Summary, method: str) -> Iterator[str]:
    """Say how one method ends beside every other.

    Args:
        summary: Of the comparison.
        method: Its name.

    Yields:
        A sentence for each of the others, in the order of their names.
    """
    for difference in _differences(summary, method):
        yield sentence(summary, difference)


def judge(summary: Summary, difference: Difference) -> Judgement:
    """Judge the end of one method beside another.

    A difference is told when its interval leaves zero out and its p value, which is corrected for the number
    of baselines, is as small as the interval is sure.

    Args:
        summary: Of the comparison.
        difference: One of the summary's.

    Returns:
        What the pair shows of the method subtracted from.
    """
    end = difference.best[-1]
    if not difference.runs:
        return "no common run"
    if math.isnan(end.mean):
        return "no objective"
    if difference.runs < least_runs(_tests(summary, difference.method), summary.confidence):
        return "too few runs"
    if _spans_zero(end) or difference.p_best[-1] > 1 - summary.confidence:
        return "not told apart"
    return "better" if end.mean > 0 else "worse"


def sentence(summary: Summary, difference: Difference) -> str:
    """Say how one method ends beside another, with the evidence.

    Args:
        summary: Of the comparison.
        difference: One of the summary's.

    Returns:
        One sentence, such as "a ends 0.12 above b (90 % interval 0.05 to 0.20, 50 paired runs): better."
    """
    found, pair = judge(summary, difference), (difference.method, difference.baseline)
    if found == "no common run":
        return f"{enumeration(pair)} have no whole run in common."
    if found == "no objective":
        return f"{enumeration(pair)} cannot be compared: in a run of both, one has no objective."
    return f"{_lead(summary, difference)}: {_ending(summary, difference, found)}."


def least_runs(baselines: int, confidence: float) -> int:
    """Count the paired runs that it takes at least to tell a method from any of its baselines.

    A sign-flip test of n runs has no p value below 2 / 2^n, which Holm's correction for b baselines
    multiplies by b.

    Args:
        baselines: How many, at least 1.
        confidence: Probability in (0, 1) that must be reached.

    Returns:
        The smallest n of b 2 / 2^n <= 1 - confidence, at least 2.
    """
    return max(2, 1 + math.ceil(math.log2(baselines / (1 - confidence))))


def _differences(summary: Summary, method: str) -> list[Difference]:
    return [each for each in summary.differences if each.method == method]


def _tests(summary: Summary, method: str) -> int:
    """How many differences of a method are tested together, at least 1."""
    return max(1, sum(not math.isnan(each.best[-1].mean) for each in _differences(summary, method)))


def _is_level(method: MethodSummary, other: MethodSummary) -> bool:
    return method.runs > 0 and method.best[-1].mean == other.best[-1].mean


def _spans_zero(end: Estimate) -> bool:
    return end.low <= 0 <= end.high


def _lead(summary: Summary, difference: Difference) -> str:
    """Who ends how far from whom; the interval is of that distance."""
    end, runs = difference.best[-1], quantity(difference.runs, "paired run")
    sign = -1 if end.mean < 0 else 1
    low, high = sorted((sign * end.low, sign * end.high))
    shown = places(*(value for value in (end.mean, low, high) if not math.isnan(value)))
    side = f"{abs(end.mean):.{shown}f} {'below' if sign < 0 else 'above'}" if end.mean else "level with"
    told = f"{difference.method} ends {side} {difference.baseline}"
    if math.isnan(low):
        return f"{told} ({runs})"
    numbers = f"{low:.{shown}f} to {high:.{shown}f}".replace("-", "−")
    return f"{told} ({summary.confidence * 100:g} % interval {numbers}, {runs})"


def _ending(summary: Summary, difference: Difference, found: Judgement) -> str:
    tests = _tests(summary, difference.method)
    if found == "too few runs":
        return f"too few runs to tell (at least {least_runs(tests, summary.confidence)} are needed)"
    if found != "not told apart":
        return found
    if _spans_zero(difference.best[-1]):
        return "cannot be told apart"
    p = difference.p_best[-1]
    return f"cannot be told apart (p = {p:.2f}, corrected for {quantity(tests, 'comparison')})"
