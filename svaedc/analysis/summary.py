"""What a comparison is made of, and what is said about it."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

from svaedc.analysis.seeds import Purpose
from svaedc.analysis.statistics import Estimate
from svaedc.analysis.strict_json import json_values


@dataclass(frozen=True)
class Row:
    """What statistics need of one trial.

    Attributes:
        method: Name of the method.
        run: The seed; runs of one seed share their first trials and hidden physics.
        trial: From 0, the shared first trials included.
        f: Objective; NaN when the trial failed.
        success: Whether the task counts as solved.
    """

    method: str
    run: int
    trial: int
    f: float
    success: bool


@dataclass(frozen=True)
class Reporting:
    """How a comparison is summarised.

    Attributes:
        initial: Shared first trials, which say nothing about a method's own suggestions.
        broken_below: A trial with an objective below this counts as broken; NaN where the task has no such
            objective, and then no share is told.
        confidence: Of every interval.
    """

    initial: int = 2
    broken_below: float = math.nan
    confidence: float = 0.9

    def __post_init__(self) -> None:
        """Refuses settings without meaning."""
        if self.initial < 0:
            raise ValueError(f"initial must be at least 0, got {self.initial}")
        if not 0 < self.confidence < 1:
            raise ValueError(f"confidence must lie between 0 and 1, got {self.confidence}")


@dataclass(frozen=True)
class FirstSuccess:
    """How many suggested trials a method needs until the task counts as solved.

    A run that never gets there says only that it needs more than it had. So the median is NaN unless more
    than half of the runs succeed, and the mean counts such a run with one trial more than it had, which
    flatters the methods that fail.

    Attributes:
        reached: Runs with a success, those in the shared first trials included, which count as 0.
        median: Of the number of suggested trials, over all runs.
        mean: Likewise.
    """

    reached: int
    median: float
    mean: Estimate


@dataclass(frozen=True)
class MethodSummary:
    """One method over its complete runs.

    Attributes:
        runs: Complete runs.
        incomplete: Runs left out because trials are missing.
        tried: Trials that were made, the shared first ones and those of incomplete runs included.
        failed: How many of these gave no objective.
        best: Best objective so far, at each trial.
        median_best: Median over runs of the same; NaN while a run has none.
        objective: Mean objective of the trials the method suggested.
        first_success: Suggested trials until the task counts as solved.
        successful_runs: Share of runs with a success.
        successful_trials: Share of the suggested trials that succeeded.
        broken_trials: Share of the suggested trials that broke.
        failed_trials: Share of the suggested trials that gave no objective; they enter no other mean.
    """

    runs: int
    incomplete: int
    tried: int
    failed: int
    best: tuple[Estimate, ...]
    median_best: tuple[float, ...]
    objective: Estimate
    first_success: FirstSuccess
    successful_runs: Estimate
    successful_trials: Estimate
    broken_trials: Estimate
    failed_trials: Estimate


@dataclass(frozen=True)
class Difference:
    """Method minus baseline on the runs both completed.

    Attributes:
        method: The one subtracted from.
        baseline: The one subtracted.
        runs: Shared complete runs.
        best: Difference of the best objective so far, at each trial.
        objective: Difference of the mean objective of the suggested trials.
        p_best: Of a two-sided sign-flip test of `best`, at each trial, after Holm's correction for the number
            of baselines this method is compared with at that trial.
        p_objective: Likewise of `objective`.
    """

    method: str
    baseline: str
    runs: int
    best: tuple[Estimate, ...]
    objective: Estimate
    p_best: tuple[float, ...]
    p_objective: float


@dataclass(frozen=True)
class Summary:
    """All that is said about a comparison.

    Attributes:
        trials: Trials of a complete run.
        purpose: What its seeds are for; numbers from tuning seeds are no results.
        confidence: Of every interval.
        methods: By name.
        differences: Every method against every other.
    """

    trials: int
    purpose: Purpose
    confidence: float
    methods: Mapping[str, MethodSummary]
    differences: tuple[Difference, ...]

    def as_json(self) -> dict[str, Any]:
        """Plain dictionaries, lists, and numbers; what is not finite, which JSON lacks, becomes None."""
        plain: dict[str, Any] = json_values(asdict(self))
        return plain
