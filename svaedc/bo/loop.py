"""One run of a method: trial after trial, from the shared first controllers on."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
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
        trial = record(index, x, evaluate(x.copy()), best, clock() - start)
        history, best = history.append(x, trial.f), trial.best
        yield trial


def record(index: int, x: Float32[np.ndarray, " D"], outcome: Outcome, best: float, seconds: float) -> Trial:
    """Make the record of a trial that was evaluated.

    Args:
        index: Of the trial, from 0.
        x: Controller, [D].
        outcome: What it showed; an objective that is not finite counts as none.
        best: Largest objective of the trials before; NaN for none.
        seconds: Time of suggesting and evaluating.

    Returns:
        The record; the trial failed if it has no objective.
    """
    f = outcome.f if math.isfinite(outcome.f) else math.nan
    failed = math.isnan(f)
    return Trial(
        index=index,
        x=x,
        f=f,
        y=outcome.y,
        best=float(np.fmax(best, f)),
        success=outcome.success and not failed,
        status="failed" if failed else "ok",
        seconds=seconds,
        stop=outcome.stop,
    )


def history_of(trials: Sequence[Trial], dimensions: int) -> History:
    """Collect what a method may learn from.

    Args:
        trials: Of a run so far, in order.
        dimensions: D, the length of a controller.

    Returns:
        Their controllers and objectives.
    """
    history = History.empty(dimensions)
    for trial in trials:
        history = history.append(trial.x, trial.f)
    return history


def _resume(initial: Float32[np.ndarray, "i D"], earlier: Sequence[Trial]) -> tuple[History, float]:
    for index, trial in enumerate(earlier):
        if trial.index != index:
            raise ValueError(f"earlier trials must count from 0 without a gap, got {trial.index} at {index}")
        if index < len(initial) and not np.array_equal(trial.x, initial[index]):
            raise ValueError(
                f"trial {index} must have tried the shared controller of its run, and did not: "
                "continue with the seed and setup the run was started with"
            )
    return history_of(earlier, initial.shape[1]), earlier[-1].best if earlier else math.nan
