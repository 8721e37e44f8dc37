"""What a comparison says: means over runs, their intervals, and paired differences between methods."""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from jaxtyping import Bool, Float

from svaedc.intervals import Estimate, bootstrap, student_t


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
        broken_below: A trial with an objective below this counts as broken.
        confidence: Of every interval.
    """

    initial: int = 2
    broken_below: float = -0.5
    confidence: float = 0.9

    def __post_init__(self) -> None:
        """Refuses settings without meaning."""
        if self.initial < 0:
            raise ValueError(f"initial must be at least 0, got {self.initial}")
        if not 0 < self.confidence < 1:
            raise ValueError(f"confidence must lie between 0 and 1, got {self.confidence}")


@dataclass(frozen=True)
class MethodSummary:
    """One method over its complete runs.

    Attributes:
        runs: Complete runs.
        incomplete: Runs left out because trials are missing.
        best: Best objective so far, at each trial.
        objective: Mean objective of the trials the method suggested.
        successful_runs: Share of runs with a success.
        successful_trials: Share of the suggested trials that succeeded.
        broken_trials: Share of the suggested trials that broke.
        failed_trials: Share of the suggested trials that gave no objective; they enter no other mean.
    """

    runs: int
    incomplete: int
    best: tuple[Estimate, ...]
    objective: Estimate
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
    """

    method: str
    baseline: str
    runs: int
    best: tuple[Estimate, ...]
    objective: Estimate


@dataclass(frozen=True)
class Summary:
    """All that is said about a comparison.

    Attributes:
        trials: Trials of a complete run.
        methods: By name.
        differences: Every method against every other.
    """

    trials: int
    methods: Mapping[str, MethodSummary]
    differences: tuple[Difference, ...]

    def as_json(self) -> dict[str, Any]:
        """Plain dictionaries, lists, and numbers; NaN, which JSON lacks, becomes None."""
        plain: dict[str, Any] = _without_nan(asdict(self))
        return plain


@dataclass(frozen=True, eq=False)
class _Runs:
    """The complete runs of one method as arrays, ordered by run."""

    run: tuple[int, ...]
    incomplete: int
    f: Float[np.ndarray, "runs trials"]
    success: Bool[np.ndarray, "runs trials"]

    @property
    def best(self) -> Float[np.ndarray, "runs trials"]:
        """Largest objective so far; NaN until there is one."""
        return np.fmax.accumulate(self.f, axis=1)


def summarise(rows: Iterable[Row], reporting: Reporting, rng: np.random.Generator) -> Summary:
    """Means and Student-t intervals over runs, and paired differences with bootstrap intervals.

    The order of the rows does not matter. A run counts when it has as many trials as the longest.

    Args:
        rows: Trials of all methods and runs.
        reporting: What counts as broken, and the width of intervals.
        rng: Draws the bootstrap resamples.

    Raises:
        ValueError: There are no rows, or one trial has two.
    """
    by_method = _by_method(rows)
    length = max(len(trials) for runs in by_method.values() for trials in runs.values())
    complete = {name: _complete(by_method[name], length) for name in sorted(by_method)}
    return Summary(
        trials=length,
        methods={name: _of_method(runs, reporting) for name, runs in complete.items()},
        differences=tuple(
            _difference(method, baseline, complete, reporting, rng)
            for method in complete
            for baseline in complete
            if method != baseline
        ),
    )


def _by_method(rows: Iterable[Row]) -> dict[str, dict[int, dict[int, Row]]]:
    by_method: dict[str, dict[int, dict[int, Row]]] = defaultdict(lambda: defaultdict(dict))
    for row in rows:
        trials = by_method[row.method][row.run]
        if row.trial in trials:
            raise ValueError(
                f"a trial must have one row, got two of {row.method} run {row.run} trial {row.trial}"
            )
        trials[row.trial] = row
    if not by_method:
        raise ValueError("a summary needs at least one trial, got no rows")
    return by_method


def _complete(runs: Mapping[int, Mapping[int, Row]], length: int) -> _Runs:
    run = tuple(sorted(run for run, trials in runs.items() if set(trials) == set(range(length))))
    table = [[runs[r][trial] for trial in range(length)] for r in run]
    f = np.array([[row.f for row in rows] for rows in table], dtype=float).reshape(-1, length)
    success = np.array([[row.success for row in rows] for rows in table], dtype=bool).reshape(-1, length)
    return _Runs(run, len(runs) - len(run), f, success)


def _of_method(runs: _Runs, reporting: Reporting) -> MethodSummary:
    def estimate(per_run: Float[np.ndarray, " runs"]) -> Estimate:
        return student_t(per_run, reporting.confidence)

    f, success = runs.f[:, reporting.initial :], runs.success[:, reporting.initial :]
    return MethodSummary(
        runs=len(runs.run),
        incomplete=runs.incomplete,
        best=tuple(map(estimate, runs.best.T)),
        objective=estimate(_mean_of_rows(f)),
        successful_runs=estimate(runs.success.any(axis=1).astype(float)),
        successful_trials=estimate(_mean_of_rows(success.astype(float))),
        broken_trials=estimate(_mean_of_rows(np.where(np.isnan(f), math.nan, f < reporting.broken_below))),
        failed_trials=estimate(_mean_of_rows(np.isnan(f).astype(float))),
    )


def _difference(
    method: str, baseline: str, complete: Mapping[str, _Runs], reporting: Reporting, rng: np.random.Generator
) -> Difference:
    ours, theirs = complete[method], complete[baseline]
    shared = sorted(set(ours.run) & set(theirs.run))

    def columns(runs: _Runs) -> Float[np.ndarray, "runs columns"]:
        rows = [runs.run.index(run) for run in shared]
        return np.column_stack([runs.best, _mean_of_rows(runs.f[:, reporting.initial :])])[rows]

    *best, objective = bootstrap(columns(ours) - columns(theirs), reporting.confidence, rng)
    return Difference(method, baseline, len(shared), tuple(best), objective)


def _mean_of_rows(values: Float[np.ndarray, "runs trials"]) -> Float[np.ndarray, " runs"]:
    """Mean over the trials that are not NaN; NaN for a run without any."""
    counted = ~np.isnan(values)
    total = np.where(counted, values, 0).sum(axis=1)
    count = counted.sum(axis=1)
    return np.divide(total, count, out=np.full(len(values), math.nan), where=count > 0)


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _without_nan(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_without_nan(part) for part in value]
    return None if isinstance(value, float) and math.isnan(value) else value
