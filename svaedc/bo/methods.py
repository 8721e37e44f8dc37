"""How the next controller is suggested: the competitors of a comparison, by name."""

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import numpy as np
import torch
from jaxtyping import Float32
from torch import Tensor

from svaedc.bo.acquisition import (
    Acquisition,
    ByGradient,
    OverPool,
    Search,
    Value,
    log_ei,
    torch_randomness,
    ucb,
)
from svaedc.bo.candidates import Candidates, Problem, as_they_are
from svaedc.bo.gp import GaussianProcess, Posterior
from svaedc.bo.history import History
from svaedc.bo.surrogates import LATENT_SURROGATES, LEAST_BAD, SURROGATES, Surrogate
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


_SEARCHES: Final[dict[str, Search]] = {"pool": OverPool(), "acqf": ByGradient()}
_ACQUISITIONS: Final[dict[str, Acquisition]] = {"ucb": ucb, "ei": log_ei}
_OURS, _PRACTITIONERS = ("pool", "ucb"), ("acqf", "ei")
_DEFAULTS: Final = {name: _OURS for name in SURROGATES | LATENT_SURROGATES} | {
    name: _PRACTITIONERS for name in ("botorch", "saasbo", "turbo")
}
_RANDOM: Final[dict[str, Callable[[Problem], Method]]] = {
    "random": lambda problem: UniformSearch(problem.dimensions),
    "screened-random": lambda problem: PoolSearch(as_they_are(problem.least_bad(LEAST_BAD))),
}
_NAMED_VARIANTS: Final = ("se-acqf", "matern-acqf")


@dataclass(frozen=True)
class _Name:
    """A method's name, read: `svae-dc-acqf-ei` is `svae-dc` by gradients with expected improvement."""

    base: str
    search: str
    acquisition: str

    @classmethod
    def read(cls, name: str) -> "_Name":
        """The parts of a name; what it leaves out is the default of its method.

        Raises:
            LookupError: No method has this name, or it has a shorter one.
        """
        base, acquisition = _without_suffix(name, _ACQUISITIONS)
        base, search = _without_suffix(base, _SEARCHES)
        if name in _RANDOM:
            return cls(name, "", "")
        if base not in _DEFAULTS:
            raise LookupError(_unknown(name))
        usual_search, usual_acquisition = _DEFAULTS[base]
        if search == usual_search or acquisition == usual_acquisition:
            raise LookupError(
                f"method must not repeat what {base!r} does anyway ({usual_search}, {usual_acquisition}), "
                f"got {name!r}: leave that part out"
            )
        return cls(base, search or usual_search, acquisition or usual_acquisition)


def names() -> tuple[str, ...]:
    """The methods of the comparison. Most also take `-pool` or `-acqf`, then `-ucb` or `-ei`, behind them."""
    return tuple(sorted([*_RANDOM, *_DEFAULTS, *_NAMED_VARIANTS]))


def needs_model(name: str) -> bool:
    """Whether a method needs the latents of a trained model.

    Raises:
        LookupError: There is no such method.
    """
    base = _Name.read(name).base
    return base in LATENT_SURROGATES or base == "screened-random"


def build(name: str, problem: Problem) -> Method:
    """Build a method for one run.

    Args:
        name: One of `names()`, perhaps with a search and an acquisition behind it.
        problem: What the methods of a run share.

    Returns:
        The method.

    Raises:
        LookupError: There is no such method.
        ValueError: The problem lacks the latents or the pool that the method needs.
    """
    read = _Name.read(name)
    try:
        return _RANDOM[name](problem) if name in _RANDOM else _optimization(read, problem)
    except ValueError as error:
        raise ValueError(f"method {name!r}: {error}") from error


def require(name: str, problem: Problem, trials: int) -> None:
    """Refuse a method that could not suggest so many controllers.

    Args:
        name: One of `names()`, perhaps with a search and an acquisition behind it.
        problem: What the methods of a run share.
        trials: Controllers it has to suggest.

    Raises:
        LookupError: There is no such method.
        ValueError: The problem lacks what the method needs, or its pool would run dry.
    """
    method = build(name, problem)
    candidates = _pool_of(method)
    if candidates is not None and len(candidates.x) < trials:
        raise ValueError(
            f"method {name!r} may choose from {len(candidates.x)} of {len(problem.pool)} controllers, "
            f"fewer than its {trials} trials: draw a larger pool"
        )


def _pool_of(method: Method) -> Candidates | None:
    match method:
        case PoolSearch(candidates):
            return candidates
        case BayesianOptimization(surrogate, _, OverPool()) | TrustRegionOptimization(
            surrogate, _, OverPool()
        ):
            return surrogate.candidates
    return None


def _optimization(name: _Name, problem: Problem) -> Method:
    if name.search == "pool" and not len(problem.pool):
        raise ValueError("a method that searches a pool needs one, got 0 controllers: draw at least one")
    kind = TrustRegionOptimization if name.base == "turbo" else BayesianOptimization
    surrogate = (SURROGATES | LATENT_SURROGATES)[name.base](problem)
    return kind(surrogate, _ACQUISITIONS[name.acquisition], _SEARCHES[name.search])


def _value(posterior: Posterior, acquisition: Acquisition, best: float) -> Value:
    def value(phi: Tensor) -> Tensor:
        return acquisition(*posterior.moments(phi), best)

    return value


def _lengthscales(posterior: Posterior) -> Tensor:
    if not isinstance(posterior, GaussianProcess):
        raise TypeError(f"a trust region needs a GaussianProcess, got {type(posterior).__name__}")
    lengthscale: Tensor = posterior.model.covar_module.base_kernel.lengthscale
    return lengthscale.flatten()


def _without_suffix(name: str, suffixes: Mapping[str, object]) -> tuple[str, str]:
    base, _, last = name.rpartition("-")
    return (base, last) if last in suffixes else (name, "")


def _unknown(name: str) -> str:
    nearest = difflib.get_close_matches(name, names(), n=1, cutoff=0.0)[0]
    return f"method must be one of {', '.join(names())}, got {name!r}: did you mean {nearest!r}?"
