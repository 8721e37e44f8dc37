"""How the next controller is suggested: the competitors of a comparison, by name."""

from collections.abc import Callable
from functools import partial
from typing import Final

import torch
from torch import Tensor

from svaedc.bo import gp, kernels, surrogates
from svaedc.bo.acquisition import (
    Acquisition,
    ByGradient,
    OverPool,
    Search,
    log_ei,
    mean,
    ucb,
)
from svaedc.bo.candidates import Candidates, Problem, as_they_are
from svaedc.bo.method_names import MethodName, names, needs_candidates, needs_model
from svaedc.bo.simulated import prior, residual
from svaedc.bo.simulated.outcomes import spread
from svaedc.bo.strategies import (
    BayesianOptimization,
    InOrder,
    Method,
    PoolSearch,
    TrustRegionOptimization,
    UniformSearch,
)
from svaedc.bo.surrogates import LEAST_BAD, Surrogate

__all__ = ["build", "names", "needs_candidates", "needs_model", "require"]

SURROGATES: Final[dict[str, Callable[[Problem], Surrogate]]] = {
    "se": partial(surrogates.on_controllers, kernels.se),
    "matern": partial(surrogates.on_controllers, kernels.matern),
    "botorch": partial(surrogates.packaged_gp, gp.default),
    "saasbo": partial(surrogates.packaged_gp, gp.saas),
    "turbo": partial(surrogates.packaged_gp, gp.turbo),
}
"""These methods learn from the controllers as they are; a new competitor is one line here or below, and one
in `svaedc.bo.method_names`."""

LATENT_SURROGATES: Final[dict[str, Callable[[Problem], Surrogate]]] = {
    "svae": partial(surrogates.on_paths, kernels.se),
    "svae-matern": partial(surrogates.on_paths, kernels.matern),
    "svae-dc": partial(surrogates.on_compressed_paths, kernels.se),
    "svae-dc-matern": partial(surrogates.on_compressed_paths, kernels.matern),
    "svae-dc-sigmoid": partial(surrogates.on_sigmoid_paths, kernels.se),
    "svae-dc-whitened": partial(surrogates.on_whitened_paths, kernels.se),
    "svae-dc-online": partial(surrogates.on_adjusted_paths, kernels.se),
    "screened-svae": partial(surrogates.on_screened_paths, kernels.se),
    "bbk-kl": surrogates.on_trajectories,
    "lkl": surrogates.on_latent_distributions,
}
"""These methods need a trained model."""

SIMULATED_SURROGATES: Final[dict[str, Callable[[Problem], Surrogate]]] = {
    f"{name}-{features}": partial(surrogate, regressors, kernels.se)
    for name, regressors in (("prior", prior.trust), ("ensemble", prior.ensemble))
    for features, surrogate in (
        ("se", prior.on_controllers),
        ("svae", prior.on_paths),
        ("svae-dc", prior.on_compressed_paths),
    )
} | {"residual-svae": residual.on_paths, "residual-svae-dc": residual.on_compressed_paths}
"""These methods need candidates that were simulated."""

_SEARCHES: Final[dict[str, Search]] = {"pool": OverPool(), "acqf": ByGradient()}
_ACQUISITIONS: Final[dict[str, Acquisition]] = {"ucb": ucb, "ei": log_ei, "mean": mean}
_UNLEARNT: Final[dict[str, Callable[[Problem], Method]]] = {
    "random": lambda problem: UniformSearch(problem.dimensions),
    "screened-random": lambda problem: PoolSearch(as_they_are(problem.least_bad(LEAST_BAD))),
    "simulated-random": lambda problem: _in_simulation(problem, PoolSearch),
    "simulated-best": lambda problem: _in_order(problem, lambda f, _: f.mean(dim=1)),
    "simulated-cautious": lambda problem: _in_order(problem, lambda f, _: f.mean(dim=1) - spread(f)),
    "least-bad": lambda problem: _in_order(problem, lambda _, y: -y.mean(dim=1)),
}
"""Nothing that a trial shows changes what these suggest next."""


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
    read = MethodName.read(name)
    try:
        return _UNLEARNT[name](problem) if name in _UNLEARNT else _optimization(read, problem)
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
        case PoolSearch(candidates) | InOrder(candidates):
            return candidates
        case BayesianOptimization(surrogate, _, OverPool()) | TrustRegionOptimization(
            surrogate, _, OverPool()
        ):
            return surrogate.candidates
    return None


def _in_order(problem: Problem, score: Callable[[Tensor, Tensor], Tensor]) -> Method:
    """By a score of the simulated objectives and badnesses [n, e]."""
    simulated, x = problem.known_outcomes(), torch.tensor(problem.pool)
    return InOrder(as_they_are(problem), score(simulated.objectives(x), simulated.badness(x)))


def _in_simulation(problem: Problem, method: Callable[[Candidates], Method]) -> Method:
    problem.known_outcomes()
    return method(as_they_are(problem))


def _optimization(name: MethodName, problem: Problem) -> Method:
    if name.search == "pool" and not len(problem.pool):
        raise ValueError("a method that searches a pool needs one, got 0 controllers: draw at least one")
    is_looked_up = name.base in LATENT_SURROGATES and problem.has_simulated_latents
    if name.search == "acqf" and (is_looked_up or name.base in SIMULATED_SURROGATES):
        raise ValueError(
            "between candidates nothing was simulated, so gradients lead nowhere: leave `-acqf` out"
        )
    kind = TrustRegionOptimization if name.base == "turbo" else BayesianOptimization
    surrogate = (SURROGATES | LATENT_SURROGATES | SIMULATED_SURROGATES)[name.base](problem)
    return kind(surrogate, _ACQUISITIONS[name.acquisition], _SEARCHES[name.search])
