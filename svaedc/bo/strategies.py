"""Ways to choose the next controller: at random, or by Bayesian optimisation, in a trust region or not."""

from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Float, Float32
from torch import Tensor

from svaedc.bo.acquisition import (
    Acquisition,
    OverPool,
    Search,
    Value,
    torch_randomness,
)
from svaedc.bo.candidates import Candidates
from svaedc.bo.gp import GaussianProcess, Posterior
from svaedc.bo.history import History
from svaedc.bo.surrogates import Surrogate
from svaedc.bo.trust_region import TrustRegion


@runtime_checkable
class Method(Protocol):
    """A way to choose the next controller."""

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """Choose the next controller: a pure function of the construction and these arguments.

        Args:
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Controller, [D], in the unit cube.
        """
        ...


@dataclass(frozen=True)
class UniformSearch:
    """Random search in the unit cube."""

    dimensions: int

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:  # noqa: ARG002
        """Draw uniformly.

        Args:
            history: Not used.
            rng: Generator of the trial.

        Returns:
            Controller, [D], in the unit cube.
        """
        return rng.random(self.dimensions).astype(np.float32)


@dataclass(frozen=True)
class PoolSearch:
    """Random search among candidates."""

    candidates: Candidates

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """Draw uniformly from the candidates no trial was spent on.

        Args:
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Candidate, [D].
        """
        return OverPool().anywhere(self.candidates, history, rng)


@dataclass(frozen=True, eq=False)
class InOrder:
    """One candidate after the other, by a score that no trial changes.

    Attributes:
        candidates: What may be suggested.
        scores: Of each; the largest comes first.
    """

    candidates: Candidates
    scores: Float[Tensor, " n"]

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:  # noqa: ARG002
        """Take the untried candidate of largest score.

        Args:
            history: Trials of the run so far.
            rng: Not used.

        Returns:
            Candidate, [D], a copy.
        """
        untried = self.candidates.untried_indices(history)
        return self.candidates.x[untried[self.scores[untried].argmax()]].copy()


@dataclass(frozen=True)
class BayesianOptimization:
    """Bayesian optimisation.

    Attributes:
        surrogate: What the trials teach about all controllers.
        acquisition: What makes a controller promising.
        search: Where the most promising one is sought.
    """

    surrogate: Surrogate
    acquisition: Acquisition
    search: Search

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """Choose the controller of largest acquisition; before the first measurement, any.

        Args:
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Controller, [D], in the unit cube.
        """
        candidates = self.surrogate.candidates
        if not len(history):
            return self.search.anywhere(candidates, history, rng)
        with torch_randomness(rng):
            posterior, best = self.surrogate.after(history)
        return self.search.maximize(_value(posterior, self.acquisition, best), candidates, history, rng)


@dataclass(frozen=True)
class TrustRegionOptimization:
    """TuRBO-1: Bayesian optimisation in a box around the best controller, which follows from the history."""

    surrogate: Surrogate
    acquisition: Acquisition
    search: Search

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """Choose the controller of largest acquisition in the box; where a box begins, any.

        Args:
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Controller, [D], in the unit cube.
        """
        region = TrustRegion.after(history.f.tolist(), history.x.shape[1])
        if region.begins:
            return self.search.anywhere(self.surrogate.candidates, history, rng)
        recent = History(history.x[region.first :], history.f[region.first :], history.failed)
        with torch_randomness(rng):
            posterior, best = self.surrogate.after(recent)
        center = torch.tensor(recent.x[recent.f.argmax()])
        box = self.surrogate.candidates.within(*region.box(center, _lengthscales(posterior)))
        return self.search.maximize(_value(posterior, self.acquisition, best), box, history, rng)


def _value(posterior: Posterior, acquisition: Acquisition, best: float) -> Value:
    def value(phi: Tensor) -> Tensor:
        return acquisition(*posterior.moments(phi), best)

    return value


def _lengthscales(posterior: Posterior) -> Tensor:
    if not isinstance(posterior, GaussianProcess):
        raise TypeError(f"a trust region needs a GaussianProcess, got {type(posterior).__name__}")
    lengthscale: Tensor = posterior.model.covar_module.base_kernel.lengthscale
    return lengthscale.flatten()
