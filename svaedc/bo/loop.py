"""One run of a method: trial after trial, from the shared first controllers on."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Float32

from svaedc.bo.history import History
from svaedc.bo.strategies import Method

Status = Literal["ok", "failed"]


@dataclass(frozen=True)
class Outcome:
    """What evaluating one controller showed.

    Attributes:
        f: Objective; NaN when the evaluation gave none. Infinite ones count as none.
        y: Badness in [0, 1]; NaN when unknown.
        success: Whether the task counts as solved.
        stop: Stop reason; empty when the trial ran to its end.
    """

    f: float
    y: float
    success: bool
    stop: str = ""


@dataclass(frozen=True, eq=False)
class Trial:
    """The record of one evaluation.

    Attributes:
        index: From 0, the shared first trials included.
        x: Controller, in the unit cube.
        f: Objective; NaN when the trial failed.
        y: Badness.
        best: Largest objective of the run so far; NaN before the first.
        success: Whether the task counts as solved.
        status: "ok", or "failed" when there is no objective.
        seconds: Time of suggesting and evaluating.
        stop: Stop reason; empty when the trial ran to its end.
    """

    index: int
    x: Float32[np.ndarray, " D"]
    f: float
    y: float
    best: float
    success: bool
    status: Status
    seconds: float
    stop: str


def trials(
    method: Method,
    evaluate: Callable[[Float32[np.ndarray, " D"]], Outcome],
    initial: Float32[np.ndarray, "i D"],
    count: int,
    rng_for: Callable[[int], np.random.Generator],
    clock: Callable[[], float],
    earlier: Sequence[Trial] = (),
) -> Iterator[Trial]:
    """Runs the trials that are still missing, each when it is asked for.

    A trial depends on the trials before it and on `rng_for(its index)` alone: a run that continues from its
    records goes on as if it had never stopped.

    Args:
        method: Suggests the controllers after the first ones.
        evaluate: Tries a controller.
        initial: The first controllers, shared by all methods of one seed.
        count: Trials the method suggests, after the initial ones.
        rng_for: The generator of a trial, by its index.
        clock: Seconds since any fixed moment.
        earlier: The records of the run so far.

    Yields:
        The missing trials, in order.

    Raises:
        ValueError: The earlier trials are not the beginning of this run.
    """
    history, best = _resume(initial, earlier)
    for index in range(len(earlier), len(initial) + count):
        start = clock()
        x = initial[index] if index < len(initial) else method.suggest(history, rng_for(index))
        outcome = _finite_or_failed(evaluate(x.copy()))
        history = history.append(x, outcome.f)
        trial = _record(index, x, outcome, best, clock() - start)
        best = trial.best
        yield trial


def _finite_or_failed(outcome: Outcome) -> Outcome:
    return outcome if math.isfinite(outcome.f) else replace(outcome, f=math.nan)


def _record(index: int, x: Float32[np.ndarray, " D"], outcome: Outcome, best: float, seconds: float) -> Trial:
    failed = math.isnan(outcome.f)
    return Trial(
        index=index,
        x=x,
        f=outcome.f,
        y=outcome.y,
        best=float(np.fmax(best, outcome.f)),
        success=outcome.success and not failed,
        status="failed" if failed else "ok",
        seconds=seconds,
        stop=outcome.stop,
    )


def _resume(initial: Float32[np.ndarray, "i D"], earlier: Sequence[Trial]) -> tuple[History, float]:
    history, best = History.empty(initial.shape[1]), math.nan
    for index, trial in enumerate(earlier):
        if trial.index != index:
            raise ValueError(f"earlier trials must count from 0 without a gap, got {trial.index} at {index}")
        if index < len(initial) and not np.array_equal(trial.x, initial[index]):
            raise ValueError(
                f"trial {index} must have tried the shared controller of its run, and did not: "
                "continue with the seed and setup the run was started with"
            )
        history, best = history.append(trial.x, trial.f), trial.best
    return history, best
