"""Ways to choose the next controller: at random, by Bayesian optimisation, and far from what failed."""

from collections.abc import Iterable
from dataclasses import dataclass
from itertools import islice
from typing import Final, Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Bool, Float, Float32
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

ATTEMPTS: Final = 16
"""A method that must avoid something is asked so often before a controller is drawn for it."""
DRAWS: Final = 10_000
"""Of so many controllers it is the first that is near nothing to avoid."""


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


@dataclass(frozen=True, eq=False)
class Avoidance:
    """A method that suggests nothing near a controller that failed.

    Attributes:
        method: Suggests.
        pool: Controllers that it may choose from, [n, D]; those near a failed one count as failed too.
        distance: Root mean square difference of two controllers' parameters, below which they are near.
    """

    method: Method
    pool: Float[np.ndarray, "n D"]
    distance: float

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """Choose the next controller; without a failed one, exactly as the method does.

        Args:
            history: Trials of the run so far.
            rng: Generator of the trial.

        Returns:
            Controller, [D], in the unit cube.

        Raises:
            ValueError: All controllers are near one that failed.
        """
        if not len(history.failed):
            return self.method.suggest(history, rng)
        asked = self._with_neighbours(history)
        for _ in range(ATTEMPTS):
            x = self.method.suggest(asked, rng)
            if not self.are_near(x[None], history.failed)[0]:
                return x
            asked = asked.append(x, np.nan)
        return self._anywhere(history, rng)

    def first(
        self, history: History, controllers: Iterable[Float32[np.ndarray, " D"]]
    ) -> Float32[np.ndarray, " D"]:
        """Take the first of some controllers that may be tried.

        Args:
            history: Trials of the run so far.
            controllers: In their order; there may be ever more.

        Returns:
            The first that was not tried and is near none that failed.

        Raises:
            ValueError: None of the first `DRAWS` may be.
        """
        tried = history.tried.astype(np.float32)
        for x in islice(controllers, DRAWS):
            if not (tried == x).all(axis=1).any() and not self.are_near(x[None], history.failed)[0]:
                return x
        raise self._nothing_left()

    def are_near(
        self, x: Float[np.ndarray, "n D"], failed: Float[np.ndarray, "m D"]
    ) -> Bool[np.ndarray, " n"]:
        """Tell which controllers are near one that failed.

        Args:
            x: Controllers, [n, D].
            failed: Those that failed, [m, D].

        Returns:
            Whether each is, [n].
        """
        near = np.zeros(len(x), dtype=bool)
        for each in failed:
            near |= np.sqrt(np.mean((x - each) ** 2, axis=1)) < self.distance
        return near

    def _with_neighbours(self, history: History) -> History:
        """The history in which candidates near a failed one failed as well."""
        near = self.pool[self.are_near(self.pool, history.failed)]
        return History(history.x, history.f, np.concatenate([history.failed, near]))

    def _anywhere(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """A controller drawn uniformly from those that are near none."""
        drawn = rng.random((DRAWS, history.x.shape[1]), dtype=np.float32)
        far = drawn[~self.are_near(drawn, history.failed)]
        if not len(far):
            raise self._nothing_left()
        return far[0].copy()

    def _nothing_left(self) -> ValueError:
        return ValueError(
            f"each of {DRAWS} controllers was tried, or lies within {self.distance:g} of one that failed or "
            "was rejected: ask for a smaller distance"
        )


def _value(posterior: Posterior, acquisition: Acquisition, best: float) -> Value:
    def value(phi: Tensor) -> Tensor:
        return acquisition(*posterior.moments(phi), best)

    return value


def _lengthscales(posterior: Posterior) -> Tensor:
    if not isinstance(posterior, GaussianProcess):
        raise TypeError(f"a trust region needs a GaussianProcess, got {type(posterior).__name__}")
    lengthscale: Tensor = posterior.model.covar_module.base_kernel.lengthscale
    return lengthscale.flatten()
