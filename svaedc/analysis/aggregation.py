"""What a comparison says: means over runs, their intervals, and paired differences between methods."""

import math
from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float

from svaedc.analysis.seeds import common_purpose
from svaedc.analysis.statistics import Estimate, bootstrap, holm, proportion, share, sign_flip, student_t
from svaedc.analysis.summary import Difference, FirstSuccess, MethodSummary, Reporting, Row, Summary


@dataclass(frozen=True, eq=False)
class _Runs:
    """The complete runs of one method as arrays, ordered by run."""

    run: tuple[int, ...]
    incomplete: int
    tried: int
    failed: int
    f: Float[np.ndarray, "runs trials"]
    success: Bool[np.ndarray, "runs trials"]

    @property
    def best(self) -> Float[np.ndarray, "runs trials"]:
        """Largest objective so far; NaN until there is one."""
        return np.fmax.accumulate(self.f, axis=1)


def summarize(rows: Iterable[Row], reporting: Reporting, rng: np.random.Generator) -> Summary:
    """Means and Student-t intervals over runs, and paired differences with bootstrap intervals.

    The order of the rows does not matter. A run counts when it has as many trials as the longest.

    Args:
        rows: Trials of all methods and runs.
        reporting: What counts as broken, and the width of intervals.
        rng: Draws the seed of resamples and sign patterns; those of a pair of methods depend on their names
            only, so A - B mirrors B - A, and a further method changes neither.

    Returns:
        Every method by itself, and every ordered pair of methods over the runs that both completed.

    Raises:
        ValueError: There are no rows, one trial has two, or reporting and tuning seeds are mixed.
    """
    by_method, seed = _by_method(rows), int(rng.integers(2**32))
    length = _longest(by_method)
    complete = {name: _complete(by_method[name], length) for name in sorted(by_method)}
    return Summary(
        trials=length,
        purpose=common_purpose(run for runs in by_method.values() for run in runs),
        confidence=reporting.confidence,
        methods={name: _of_method(runs, reporting) for name, runs in complete.items()},
        differences=tuple(
            difference
            for method in complete
            for difference in _differences(method, complete, reporting, seed)
        ),
    )


def best_of_runs(rows: Iterable[Row]) -> dict[str, Float[np.ndarray, "runs trials"]]:
    """The largest objective so far of every complete run, by method; NaN until there is one.

    Raises:
        ValueError: There are no rows, or one trial has two.
    """
    by_method = _by_method(rows)
    length = _longest(by_method)
    return {name: _complete(by_method[name], length).best for name in sorted(by_method)}


def _longest(by_method: Mapping[str, Mapping[int, Mapping[int, Row]]]) -> int:
    return max(len(trials) for runs in by_method.values() for trials in runs.values())


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
    every = [row for trials in runs.values() for row in trials.values()]
    failed = sum(math.isnan(row.f) for row in every)
    return _Runs(run, len(runs) - len(run), len(every), failed, f, success)


def _of_method(runs: _Runs, reporting: Reporting) -> MethodSummary:
    def estimate(per_run: Float[np.ndarray, " runs"]) -> Estimate:
        return student_t(per_run, reporting.confidence)

    def part(of_trials: Float[np.ndarray, "runs trials"]) -> Estimate:
        return share(_mean_of_rows(of_trials), reporting.confidence)

    f, success = runs.f[:, reporting.initial :], runs.success[:, reporting.initial :]
    return MethodSummary(
        runs=len(runs.run),
        incomplete=runs.incomplete,
        tried=runs.tried,
        failed=runs.failed,
        best=tuple(map(estimate, runs.best.T)),
        median_best=_medians(runs.best),
        objective=estimate(_mean_of_rows(f)),
        first_success=_first_success(runs.success, reporting),
        successful_runs=proportion(np.asarray(runs.success.any(axis=1)), reporting.confidence),
        successful_trials=part(success.astype(float)),
        broken_trials=part(
            np.where(np.isnan(f - reporting.broken_below), math.nan, f < reporting.broken_below)
        ),
        failed_trials=part(np.isnan(f).astype(float)),
    )


def _medians(best: Float[np.ndarray, "runs trials"]) -> tuple[float, ...]:
    return tuple(np.median(best, axis=0).tolist()) if len(best) else (math.nan,) * best.shape[1]


def _first_success(success: Bool[np.ndarray, "runs trials"], reporting: Reporting) -> FirstSuccess:
    never = success.shape[1] - reporting.initial + 1
    reached: Bool[np.ndarray, " runs"] = np.asarray(success.any(axis=1))
    suggested = (success.argmax(axis=1) + 1 - reporting.initial).clip(0)
    needed = np.where(reached, suggested, never).astype(float)
    median = float(np.median(needed)) if 2 * reached.sum() > len(reached) else math.nan
    return FirstSuccess(int(reached.sum()), median, student_t(needed, reporting.confidence))


def _differences(
    method: str, complete: Mapping[str, _Runs], reporting: Reporting, seed: int
) -> list[Difference]:
    """A method against every other, its p values corrected together."""
    baselines = [name for name in complete if name != method]
    rngs = [np.random.default_rng([seed, *"\n".join(sorted((method, name))).encode()]) for name in baselines]
    paired = [_paired_differences(complete[method], complete[name], reporting) for name in baselines]
    if not paired:
        return []
    p = holm(np.stack([sign_flip(values, rng) for values, rng in zip(paired, rngs, strict=True)]))
    estimates = [
        bootstrap(values, reporting.confidence, rng) for values, rng in zip(paired, rngs, strict=True)
    ]
    return [
        Difference(method, name, len(values), each[:-1], each[-1], tuple(p_values[:-1]), p_values[-1])
        for name, values, each, p_values in zip(baselines, paired, estimates, p.tolist(), strict=True)
    ]


def _paired_differences(
    ours: _Runs, theirs: _Runs, reporting: Reporting
) -> Float[np.ndarray, "runs columns"]:
    """Differences of the shared runs: best so far at each trial, then the mean objective."""
    shared = sorted(set(ours.run) & set(theirs.run))

    def columns(runs: _Runs) -> Float[np.ndarray, "runs columns"]:
        rows = [runs.run.index(run) for run in shared]
        return np.column_stack([runs.best, _mean_of_rows(runs.f[:, reporting.initial :])])[rows]

    return columns(ours) - columns(theirs)


def _mean_of_rows(values: Float[np.ndarray, "runs trials"]) -> Float[np.ndarray, " runs"]:
    """Mean over the trials that are not NaN; NaN for a run without any."""
    counted = ~np.isnan(values)
    total = np.where(counted, values, 0).sum(axis=1)
    count = counted.sum(axis=1)
    return np.divide(total, count, out=np.full(len(values), math.nan), where=count > 0)
