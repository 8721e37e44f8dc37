"""How the next controller is suggested: the competitors of a comparison, by name."""

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

from svaedc.bo import gp, kernels, surrogates
from svaedc.bo.acquisition import (
    Acquisition,
    ByGradient,
    OverPool,
    Search,
    log_ei,
    ucb,
)
from svaedc.bo.candidates import Candidates, Problem, as_they_are
from svaedc.bo.strategies import (
    BayesianOptimization,
    Method,
    PoolSearch,
    TrustRegionOptimization,
    UniformSearch,
)
from svaedc.bo.surrogates import LEAST_BAD, Surrogate

SURROGATES: Final[dict[str, Callable[[Problem], Surrogate]]] = {
    "se": partial(surrogates.on_controllers, kernels.se),
    "matern": partial(surrogates.on_controllers, kernels.matern),
    "botorch": partial(surrogates.packaged_gp, gp.default),
    "saasbo": partial(surrogates.packaged_gp, gp.saas),
    "turbo": partial(surrogates.packaged_gp, gp.turbo),
}
"""These methods learn from the controllers as they are; a new competitor is one line here or below."""

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


def _without_suffix(name: str, suffixes: Mapping[str, object]) -> tuple[str, str]:
    base, _, last = name.rpartition("-")
    return (base, last) if last in suffixes else (name, "")


def _unknown(name: str) -> str:
    nearest = difflib.get_close_matches(name, names(), n=1, cutoff=0.0)[0]
    return f"method must be one of {', '.join(names())}, got {name!r}: did you mean {nearest!r}?"
