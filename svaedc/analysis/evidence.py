"""Numbers that decide what a paper claims of its methods, taken from comparisons, each with a verdict."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final, Literal, Protocol, runtime_checkable

from svaedc.analysis.statistics import Estimate, ratio
from svaedc.analysis.summary import MethodSummary, Summary

Verdict = Literal["holds", "does not hold", "open", "not measured"]
Panels = Mapping[str, Summary]
"""These are the comparisons of a figure, by the name of their panel."""

NOTHING: Final = Estimate(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class Finding:
    """What was measured, and what it says of a claim.

    Attributes:
        value: The number the claim is about, with its 90 % interval.
        runs: It is a mean over so many.
        verdict: "open" where the interval leaves both answers possible.
    """

    value: Estimate
    runs: int
    verdict: Verdict


UNKNOWN: Final = Finding(NOTHING, 0, "not measured")


@runtime_checkable
class Evidence(Protocol):
    """A number that decides a claim."""

    @property
    def panel(self) -> str:
        """Name of the panel it is taken from."""
        ...

    @property
    def measure(self) -> str:
        """What the number is, in words."""
        ...

    def finding(self, panels: Panels, initial: int) -> Finding:
        """Measure the number, and judge the claim by it.

        Args:
            panels: Comparisons by the name of their panel.
            initial: Shared random trials that every run began with.

        Returns:
            The number and its verdict; "not measured" where the panel or the method is missing.
        """
        ...


@dataclass(frozen=True)
class Successes:
    """The share of runs, or of suggested trials, with a success lies in a range.

    Attributes:
        panel: Name of the panel.
        method: Whose runs.
        among: What is counted.
        low: Smallest share that agrees with the claim.
        high: Largest share.
    """

    panel: str
    method: str
    among: Literal["runs", "trials"]
    low: float
    high: float

    @property
    def measure(self) -> str:
        """Whose share, and of what."""
        return f"{self.method}, share of {self.among} with a success"

    def finding(self, panels: Panels, initial: int) -> Finding:  # noqa: ARG002
        """Holds if the measured share lies in the range; its interval decides nothing.

        Args:
            panels: Comparisons by the name of their panel.
            initial: Not used: the summary has counted already.

        Returns:
            The share with its interval, or `UNKNOWN`.
        """
        method = _method(panels.get(self.panel), self.method)
        if method is None:
            return UNKNOWN
        share = method.successful_runs if self.among == "runs" else method.successful_trials
        return Finding(
            share, method.runs, "holds" if self.low <= share.mean <= self.high else "does not hold"
        )


@dataclass(frozen=True)
class MedianGap:
    """What the median run lacks to the optimum lies in a range.

    Attributes:
        panel: Name of the panel.
        method: Whose runs.
        optimum: Largest objective there is.
        after: Suggested trials.
        low: Smallest gap that agrees with the claim.
        high: Largest one.
    """

    panel: str
    method: str
    optimum: float
    after: int
    low: float = 0.0
    high: float = math.inf

    @property
    def measure(self) -> str:
        """Whose gap, and the end of the range that is not without meaning."""
        limit = f" ≤ {self.high:g}" if self.high < math.inf else f" ≥ {self.low:g}"
        return f"{self.method}, median gap to {self.optimum:g}{limit}, best after {self.after}"

    def finding(self, panels: Panels, initial: int) -> Finding:
        """Holds if the median lies in the range; it has no interval.

        Args:
            panels: Comparisons by the name of their panel.
            initial: Shared random trials that every run began with.

        Returns:
            The gap, or `UNKNOWN`, also where a run has fewer trials or none that was measured.
        """
        method, index = _method(panels.get(self.panel), self.method), initial + self.after - 1
        if method is None or index >= len(method.median_best):
            return UNKNOWN
        gap = self.optimum - method.median_best[index]
        if math.isnan(gap):
            return UNKNOWN
        verdict: Verdict = "holds" if self.low <= gap <= self.high else "does not hold"
        return Finding(Estimate(gap, math.nan, math.nan), method.runs, verdict)


@dataclass(frozen=True)
class Steadier:
    """A method's runs end closer together in one panel than in another.

    Attributes:
        panel: Where they are said to be closer.
        than: Name of the other panel.
        method: Whose runs.
    """

    panel: str
    than: str
    method: str

    @property
    def measure(self) -> str:
        """Ratio of widths."""
        return f"{self.method}, width of the last interval, {self.panel} / {self.than}"

    def finding(self, panels: Panels, initial: int) -> Finding:  # noqa: ARG002
        """Holds if the interval of the ratio, over equal numbers of runs, is below 1.

        Args:
            panels: Comparisons by the name of their panel.
            initial: Not used: the last trial decides.

        Returns:
            The ratio with its interval, or `UNKNOWN`, also with fewer than two runs or unequal numbers of
            them.
        """
        found = [_method(panels.get(name), self.method) for name in (self.panel, self.than)]
        counts = [method.runs if method else 0 for method in found]
        if min(counts) < 2 or len(set(counts)) > 1:
            return UNKNOWN
        narrow, wide = (method.best[-1].high - method.best[-1].low for method in found if method)
        # Student's intervals of equally many runs are as wide as their standard deviations.
        value = ratio(narrow, wide, counts[0], 0.9)
        verdict: Verdict = "holds" if value.high < 1 else "does not hold" if value.low > 1 else "open"
        return Finding(value, counts[0], verdict)


@dataclass(frozen=True)
class FewerBroken:
    """A method breaks fewer trials than another: at most so many for each of the other's.

    Attributes:
        panel: Name of the panel.
        method: Whose trials are said to break less.
        baseline: Whose trials they are held against.
        ratio: Largest ratio of the two shares that agrees with the claim.
    """

    panel: str
    method: str
    baseline: str
    ratio: float

    @property
    def measure(self) -> str:
        """Whose shares, and their largest ratio."""
        return f"{self.method} / {self.baseline}, broken trials ≤ {self.ratio:.2f}"

    def finding(self, panels: Panels, initial: int) -> Finding:  # noqa: ARG002
        """Holds if the ratio of the measured shares is not larger; it has no interval.

        Args:
            panels: Comparisons by the name of their panel.
            initial: Not used: the summary has counted already.

        Returns:
            The ratio, or `UNKNOWN`, also where the baseline broke nothing.
        """
        found = [_method(panels.get(self.panel), name) for name in (self.method, self.baseline)]
        shares = [method.broken_trials.mean if method else math.nan for method in found]
        if not shares[1] > 0 or math.isnan(shares[0]):
            return UNKNOWN
        value, runs = shares[0] / shares[1], min(method.runs for method in found if method)
        verdict: Verdict = "holds" if value <= self.ratio else "does not hold"
        return Finding(Estimate(value, math.nan, math.nan), runs, verdict)


def _method(summary: Summary | None, method: str) -> MethodSummary | None:
    found = summary.methods.get(method) if summary else None
    return found if found and found.runs else None


@dataclass(frozen=True)
class Claim:
    """A sentence of the paper, or a question of this project, and the numbers that answer it.

    Attributes:
        text: What is claimed.
        source: Where it stands in the paper; "control" for what the paper does not say.
        evidence: All of it has to hold.
    """

    text: str
    source: str
    evidence: tuple[Evidence, ...]

    def __post_init__(self) -> None:
        """Refuse a claim that nothing could answer."""
        if not self.evidence:
            raise ValueError(f"a claim needs at least one piece of evidence, got none for {self.text!r}")
