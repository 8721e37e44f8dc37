"""How the next controller is suggested: the competitors of a comparison, by name."""

import difflib
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol, runtime_checkable

import numpy as np
import torch
from gpytorch.kernels import Kernel
from jaxtyping import Float32

from svaedc import bo, kernels
from svaedc.candidates import Candidates, Problem, as_they_are, by_latents
from svaedc.features import Embedding, Whitened, svae, svae_dc
from svaedc.history import History

LEAST_BAD = 0.3
"""Share of the pool that screening keeps."""


@runtime_checkable
class Method(Protocol):
    """A way to choose the next controller."""

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """The next controller, in the unit cube: a pure function of its construction and these arguments."""
        ...


@dataclass(frozen=True)
class UniformSearch:
    """Random search in the unit cube."""

    dimensions: int

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:  # noqa: ARG002
        """A uniform draw."""
        return rng.random(self.dimensions).astype(np.float32)


@dataclass(frozen=True)
class PoolSearch:
    """Random search among candidates."""

    candidates: Candidates

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """A uniform draw from the candidates no trial was spent on."""
        return self.candidates.x[rng.choice(self.candidates.untried(history))].copy()


@dataclass(frozen=True)
class PoolOptimisation:
    """Bayesian optimisation: UCB of a Gaussian process on features, maximised over the candidates.

    Attributes:
        candidates: What may be suggested, and the features the kernel compares.
        kernel: Makes the kernel on the features, with its starting hyper-parameters.
        objective_limits: Objectives that count as 0 and 1.
    """

    candidates: Candidates
    kernel: Callable[[], Kernel]
    objective_limits: tuple[float, float]

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """The untried candidate of largest UCB; before the first measurement, any."""
        if not len(history):
            return PoolSearch(self.candidates).suggest(history, rng)
        untried = self.candidates.untried(history)
        f = bo.scaled(torch.tensor(history.f), self.objective_limits)
        surrogate = bo.fit(self.kernel, self.candidates.features_of(history.x), f)
        best = bo.ucb(surrogate.model, self.candidates.phi[untried]).argmax()
        return self.candidates.x[untried[best]].copy()


@dataclass(frozen=True)
class BotorchDefault:
    """What a practitioner writes today: BoTorch's default process and log expected improvement."""

    dimensions: int

    def suggest(self, history: History, rng: np.random.Generator) -> Float32[np.ndarray, " D"]:
        """The maximum of log expected improvement; before the first measurement, a uniform draw."""
        if not len(history):
            return UniformSearch(self.dimensions).suggest(history, rng)
        with bo.torch_randomness(rng):
            best = bo.maximise_log_ei(torch.tensor(history.x), torch.tensor(history.f))
        x = best.numpy().astype(np.float32)
        # The process learns nothing from a failed trial and would ask for the same one for ever.
        return UniformSearch(self.dimensions).suggest(history, rng) if history.has_failed(x) else x


KernelOf = Callable[[int], Kernel]


def names() -> tuple[str, ...]:
    """Every method `build` knows."""
    return tuple(sorted(_RECIPES | _RECIPES_WITH_MODEL))


def needs_model(name: str) -> bool:
    """Whether a method needs the latents of a trained model.

    Raises:
        LookupError: There is no such method.
    """
    _recipe(name)
    return name in _RECIPES_WITH_MODEL


def build(name: str, problem: Problem) -> Method:
    """The method of this name for one run.

    Raises:
        LookupError: There is no such method.
        ValueError: The problem lacks the latents or the pool that the method needs.
    """
    recipe = _recipe(name)
    try:
        return recipe(problem)
    except ValueError as error:
        raise ValueError(f"method {name!r}: {error}") from error


def _recipe(name: str) -> Callable[[Problem], Method]:
    recipes = _RECIPES | _RECIPES_WITH_MODEL
    if name not in recipes:
        nearest = difflib.get_close_matches(name, recipes, n=1, cutoff=0.0)[0]
        raise LookupError(
            f"method must be one of {', '.join(names())}, got {name!r}: did you mean {nearest!r}?"
        )
    return recipes[name]


def _on_controllers(problem: Problem, kernel: KernelOf) -> Method:
    return PoolOptimisation(
        as_they_are(problem), partial(kernel, problem.dimensions), problem.objective_limits
    )


def _on_latents(problem: Problem, embedding: Embedding, kernel: KernelOf) -> Method:
    candidates = by_latents(problem, embedding)
    return PoolOptimisation(candidates, partial(kernel, candidates.phi.shape[1]), problem.objective_limits)


def _whitened(problem: Problem) -> Method:
    latents = problem.known_latents()
    # One lengthscale: whitening has already made the dimensions equal.
    return _on_latents(problem, Whitened.over(latents.tau, latents.y), lambda _: kernels.se(1))


_RECIPES: dict[str, Callable[[Problem], Method]] = {
    "random": lambda problem: UniformSearch(problem.dimensions),
    "botorch": lambda problem: BotorchDefault(problem.dimensions),
    "se": partial(_on_controllers, kernel=kernels.se),
    "matern": partial(_on_controllers, kernel=kernels.matern),
}

_RECIPES_WITH_MODEL: dict[str, Callable[[Problem], Method]] = {
    "screened-random": lambda problem: PoolSearch(as_they_are(problem.least_bad(LEAST_BAD))),
    "screened-svae": lambda problem: _on_latents(problem.least_bad(LEAST_BAD), svae, kernels.se),
    "svae": partial(_on_latents, embedding=svae, kernel=kernels.se),
    "svae-dc": partial(_on_latents, embedding=svae_dc, kernel=kernels.se),
    "svae-dc-whitened": _whitened,
}
