"""Evidence from the difference of two methods over shared seeds."""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass

from svaedc.analysis.evidence import UNKNOWN, Finding, Panels, Verdict
from svaedc.analysis.statistics import Estimate
from svaedc.analysis.summary import Difference, Summary


@dataclass(frozen=True)
class _Paired(ABC):
    """A method's best objective so far minus a baseline's, over shared seeds.

    Attributes:
        panel: Name of the panel.
        method: The one subtracted from.
        baseline: The one subtracted.
        after: Suggested trials.
    """

    panel: str
    method: str
    baseline: str
    after: int

    @property
    def measure(self) -> str:
        """Method minus baseline, and what that is said to be."""
        return f"{self.method} − {self.baseline}{self._said()}, best after {self.after}"

    def finding(self, panels: Panels, initial: int) -> Finding:
        """The paired difference; open where one run has no interval."""
        difference = _difference(panels.get(self.panel), self.method, self.baseline)
        index = initial + self.after - 1
        if difference is None or not difference.runs or index >= len(difference.best):
            return UNKNOWN
        value = difference.best[index]
        return Finding(value, difference.runs, "open" if math.isnan(value.low) else self._verdict(value))

    @abstractmethod
    def _said(self) -> str: ...

    @abstractmethod
    def _verdict(self, value: Estimate) -> Verdict: ...


@dataclass(frozen=True)
class Gain(_Paired):
    """The difference lies in a range: its whole interval, or it does not hold if none of it does.

    Attributes:
        low: Smallest gain that agrees with the claim; 0 says that the method is better.
        high: Largest gain.
    """

    low: float = 0.0
    high: float = math.inf

    def _said(self) -> str:
        return f" ≤ {self.high:g}" if self.high < math.inf else ""

    def _verdict(self, value: Estimate) -> Verdict:
        if self.low < value.low and value.high < self.high:
            return "holds"
        return "does not hold" if value.high < self.low or self.high < value.low else "open"


@dataclass(frozen=True)
class Like(_Paired):
    """The two are not told apart: the interval of the difference includes 0.

    Few runs tell hardly anything apart, so a claim of this kind means as much as the interval is narrow.
    """

    def _said(self) -> str:
        return " ≈ 0"

    def _verdict(self, value: Estimate) -> Verdict:
        return "holds" if value.low <= 0 <= value.high else "does not hold"


@dataclass(frozen=True)
class NoBetter(_Paired):
    """The method is not above the baseline, and may be below: the interval is not wholly above 0."""

    def _said(self) -> str:
        return " ≤ 0"

    def _verdict(self, value: Estimate) -> Verdict:
        return "does not hold" if value.low > 0 else "holds"


def _difference(summary: Summary | None, method: str, baseline: str) -> Difference | None:
    differences = summary.differences if summary else ()
    wanted = (method, baseline)
    return next((each for each in differences if (each.method, each.baseline) == wanted), None)
