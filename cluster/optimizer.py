"""Bayesian optimisation for a robot of one's own: ask for a controller, try it, tell what it was worth."""

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
from jaxtyping import Float32

from cluster.comparison.records import append, read_trials
from cluster.config import CompareSettings
from cluster.inputs import setup_of, usage_errors
from cluster.optimization import methods
from cluster.optimization.factory import Optimization
from cluster.optimization.models import trained_model
from svaedc.bo.loop import Outcome, Trial, history_of, record
from svaedc.model.svae_dc import SvaeDc
from workers.controllers.controller import unit_cube
from workers.hardware import robots
from workers.setups import Setup

_USUAL = CompareSettings()


class Optimizer:
    """A method that suggests controllers one after the other, from nothing but what it was told.

    What `ask` answers is a function of the arguments below and of the trials that were told: two optimisers
    that agree in these agree in all controllers, and with the run of `svaedc compare` of that seed.

    Args:
        setup: whose controllers are tried, or its name.
        method: its name; see `svaedc.method_names`.
        model: folder of a model of this setup; None for methods that need none.
        seed: of every draw, at least 0.
        trials: told before, in their order; those of `file` come instead if it exists.
        file: keeps every trial, one line each, on disk before `tell` returns; None keeps them in memory only.
            The next optimiser with this file goes on from it.
        initial: random controllers that come first.
        pool_size: controllers that a method with a pool may choose from.

    Raises:
        UsageError: there is no such setup or method, or the method lacks its model.
        UserError: the model or the file cannot be used.
    """

    def __init__(
        self,
        setup: Setup | str,
        method: str = "svae-dc",
        *,
        model: Path | str | None = None,
        seed: int = 0,
        trials: Iterable[Trial] = (),
        file: Path | str | None = None,
        initial: int = _USUAL.initial_trials,
        pool_size: int = _USUAL.pool_size,
    ) -> None:
        self.setup = setup_of(setup) if isinstance(setup, str) else setup
        self._file = None if file is None else Path(file)
        self._initial = initial
        with usage_errors():
            network = _network(self.setup, model) if methods.needs_model(method) else None
            self._optimization = Optimization(self.setup, method, seed, pool_size, network)
            self._method = self._optimization.build()
        kept = read_trials(self._file) if self._file else []
        self._trials = kept or list(trials)

    @property
    def trials(self) -> tuple[Trial, ...]:
        """Everything that was told, in its order."""
        return tuple(self._trials)

    @property
    def best(self) -> Trial | None:
        """The trial of largest objective so far; None before the first that was measured."""
        measured = [trial for trial in self._trials if trial.status == "ok"]
        return max(measured, key=lambda trial: trial.f, default=None)

    def ask(self) -> Float32[np.ndarray, " D"]:
        """The controller to try next, [D] in the unit cube; the same one until something is told."""
        index = len(self._trials)
        if index < self._initial:
            return self._optimization.initial(index)
        history = history_of(self._trials, self.setup.dimensions)
        return self._method.suggest(history, self._optimization.rng(index))

    def tell(self, x: np.ndarray, f: float, y: float = math.nan) -> Trial:
        """Say what a controller was worth; it need not be one that was asked for.

        Args:
            x: the controller, [D] in the unit cube.
            f: its objective, which is maximised; NaN for a trial that failed.
            y: its badness in [0, 1]; NaN where nobody knows.

        Returns:
            The record of the trial.

        Raises:
            ValueError: x has another length or leaves the unit cube, or y leaves [0, 1].
            OSError: the file cannot be written; the trial then counts as not told.
        """
        tried = unit_cube(x, self.setup.dimensions)
        if not (math.isnan(y) or 0.0 <= y <= 1.0):
            raise ValueError(f"y must lie in [0, 1], or be NaN where nobody knows it, got {y}")
        outcome = Outcome(f=float(f), y=float(y), success=bool(f > self.setup.success))
        best = self._trials[-1].best if self._trials else math.nan
        trial = record(len(self._trials), tried, outcome, best, seconds=0.0)
        if self._file:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            append(self._file, trial)
        self._trials.append(trial)
        return trial


def _network(setup: Setup, model: Path | str | None) -> SvaeDc:
    if model is None:
        raise ValueError("this method needs a trained model: name its folder with model=")
    return trained_model(Path(model), setup.name, robots.stands_in_for(setup.name)).model
