"""The controllers a method may suggest, with the features its kernel compares."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
import torch
from jaxtyping import Float, Float32, Int
from torch import Tensor

from svaedc.bo.distribution_features import Densities, Density
from svaedc.bo.features import Embedding, Latents
from svaedc.bo.history import History
from svaedc.bo.online import Adjustable
from svaedc.bo.simulated.outcomes import SimulatedLatents, SimulatedOutcomes

Part = TypeVar("Part")


@dataclass(frozen=True, eq=False)
class Problem:
    """What the methods of one run share.

    Attributes:
        dimensions: D, the number of controller parameters.
        objective_limits: Objectives that count as 0 and 1, fixed per setup and never taken from the run.
        pool: Random controllers in the unit cube, fresh per run; may be empty ([0, D]) where no method needs
            one.
        latents: What the frozen model says of the pool, for methods that need it.
        densities: Its distributions, for the KL kernels.
        adjustable: The model itself, where its last layers are adjusted online.
        largest_y: Controllers predicted worse than this are out of bounds.
        simulated: How the pool fared in simulation, for methods that use that; the pool is then of simulated
            controllers alone.
    """

    dimensions: int
    objective_limits: tuple[float, float]
    pool: Float32[np.ndarray, "n D"]
    latents: Latents | None = None
    densities: Densities | None = None
    adjustable: Adjustable | None = None
    largest_y: float = 1.0
    simulated: SimulatedOutcomes | None = None

    def __post_init__(self) -> None:
        """Refuses parts that do not belong together."""
        low, high = self.objective_limits
        if not low < high:
            raise ValueError(f"objective_limits must be (low, high) with low < high, got ({low}, {high})")
        if self.pool.ndim != 2 or self.pool.shape[1] != self.dimensions:
            raise ValueError(f"pool must be [n, {self.dimensions}], got {list(self.pool.shape)}")
        if not ((self.pool >= 0) & (self.pool <= 1)).all():
            raise ValueError("every controller of the pool must lie in the unit cube")
        if self.latents is not None and len(self.latents.y) != len(self.pool):
            raise ValueError(
                f"latents must be those of the pool's {len(self.pool)} controllers, got {len(self.latents.y)}"
            )

    def known_latents(self) -> Latents:
        """The latents; without them, a `ValueError`."""
        return _require(self.latents, "latents", "Latents.of(pool, model.latent_means)")

    def known_badness(self) -> Latents:
        """The latents of a model that predicts badness; without them, or with an SVAE's, a `ValueError`."""
        latents = self.known_latents()
        if len(latents.y) and not latents.y.any():
            raise ValueError(
                "the model must predict badness, got an SVAE, which predicts 0 everywhere: "
                "train an SVAE-DC, or use the method svae"
            )
        return latents

    def known_densities(self) -> Densities:
        """The distributions; without them, a `ValueError`."""
        return _require(self.densities, "densities", "Densities.of(model)")

    def known_outcomes(self) -> SimulatedOutcomes:
        """The simulated outcomes; without them, a `ValueError`."""
        if self.simulated is None:
            raise ValueError(
                "it needs candidates that were simulated, got none: make some with `svaedc candidates`, and "
                "name their folder with --candidates"
            )
        return self.simulated

    @property
    def has_simulated_latents(self) -> bool:
        """Whether the latents are those of simulated candidates, and of no other controllers."""
        return self.latents is not None and isinstance(self.latents.at, SimulatedLatents)

    def known_adjustable(self) -> Adjustable:
        """The model; without one, a `ValueError`."""
        return _require(self.adjustable, "adjustable layers", "Adjustable(model)")

    def least_bad(self, share: float) -> "Problem":
        """The same problem with only this share of the pool, the controllers predicted least bad."""
        latents = self.known_badness()
        kept = torch.argsort(latents.y, stable=True)[: math.ceil(share * len(self.pool))]
        screened = replace(latents, tau=latents.tau[kept], y=latents.y[kept])
        largest_y = float(screened.y.max()) if len(kept) else 0.0
        return replace(self, pool=self.pool[kept.numpy()], latents=screened, largest_y=largest_y)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Controllers and their features in units of their typical distance.

    Dividing by one number leaves the kernels as the paper has them and gives every kernel the same unit of
    lengthscale, so that one range of lengthscales fits controllers and latent paths of any model.

    Attributes:
        x: The controllers.
        phi: Their features divided by `unit`, float64.
        embed: Features of any controllers (float64, [n, D]), not yet divided; gradients reach them.
        unit: Root-mean-square distance between the features of two candidates.
        excess: How much worse than allowed any controllers are predicted; 0 where nothing is forbidden.
        low: Smallest value of each controller parameter that a search off the pool may try.
        high: Largest value.
    """

    x: Float32[np.ndarray, "n D"]
    phi: Float[Tensor, "n k"]
    embed: Callable[[Tensor], Tensor]
    unit: float
    excess: Callable[[Tensor], Tensor]
    low: Float[Tensor, " D"]
    high: Float[Tensor, " D"]

    @classmethod
    def of(cls, problem: Problem, embed: Callable[[Tensor], Tensor]) -> "Candidates":
        """Give the pool features in units of their typical distance.

        Args:
            problem: What the methods of a run share.
            embed: Features [n, k] of controllers [n, D], float64.

        Returns:
            The pool; the unit is 1 where it is empty or all features are the same.
        """
        raw = Candidates.embed_pool(problem, embed)
        unit = math.sqrt(2 * float(raw.phi.var(dim=0, correction=0).sum())) if len(raw.x) else 1.0
        return raw.in_units_of(unit or 1.0)

    @classmethod
    def embed_pool(cls, problem: Problem, embed: Callable[[Tensor], Tensor]) -> "Candidates":
        """Give the pool features as they are.

        Args:
            problem: What the methods of a run share.
            embed: Features [n, k] of controllers [n, D], float64.

        Returns:
            The pool with a unit of 1, between the bounds of the unit cube.
        """
        with torch.no_grad():
            phi = embed(torch.tensor(problem.pool).double())
        low = torch.zeros(problem.dimensions).double()
        return cls(problem.pool, phi, embed, 1.0, partial(_excess, problem), low, low + 1)

    def in_units_of(self, unit: float) -> "Candidates":
        """The same candidates with features divided by this."""
        return replace(self, phi=self.phi / unit, unit=unit)

    def within(self, low: Float[Tensor, " D"], high: Float[Tensor, " D"]) -> "Candidates":
        """Squeeze the candidates into a box.

        Args:
            low: Lower corner, [D].
            high: Upper corner, [D].

        Returns:
            As many candidates, whose features are computed anew and whose bounds are the box.
        """
        x = (low + (high - low) * torch.tensor(self.x)).float()
        return replace(self, x=x.numpy(), phi=self.features_of(x.double()), low=low, high=high)

    def features_of(self, x: Float[Tensor, "t D"]) -> Float[Tensor, "t k"]:
        """Features of any controllers, in the same unit; gradients reach them."""
        return self.embed(x) / self.unit

    def untried_indices(self, history: History) -> Int[np.ndarray, " u"]:
        """Indices of the candidates no trial was spent on.

        Raises:
            ValueError: There are none left.
        """
        if not len(self.x):
            raise ValueError("a method that searches a pool needs one, got 0 controllers: draw at least one")
        tried = np.zeros(len(self.x), dtype=bool)
        for x in history.tried.astype(np.float32):
            tried |= (self.x == x).all(axis=1)
        if tried.all():
            raise ValueError(f"all {len(self.x)} candidates have been tried: draw a larger pool")
        return np.flatnonzero(~tried)


def as_they_are(problem: Problem) -> Candidates:
    """The pool, compared by controller parameters: phi(x) = x."""
    # Of two uniform controllers, the mean square distance is D / 6, also where there is no pool to tell.
    return in_the_cube(problem).in_units_of(math.sqrt(problem.dimensions / 6))


def in_the_cube(problem: Problem) -> Candidates:
    """The pool, compared by controller parameters in the unit cube, as packaged methods expect them."""
    return Candidates.embed_pool(problem, _identity)


def by_latents(problem: Problem, embedding: Embedding) -> Candidates:
    """The pool, compared by latent paths: phi(x) = embedding(tau of x, y of x).

    Args:
        problem: What the methods of a run share, with latents.
        embedding: phi of latent paths [n, k] and badness [n].

    Returns:
        The pool, in units of the features' typical distance.
    """
    latents = problem.known_latents()
    return Candidates.of(problem, lambda x: embedding(*latents.means(x)))


def by_density(problem: Problem, density: Density) -> Candidates:
    """The pool, compared by distributions, whose divergence has no unit: phi(x) = [location | log scale].

    Args:
        problem: What the methods of a run share.
        density: Distribution of each controller.

    Returns:
        The pool, with the rows that the density's divergence compares as features.
    """
    return Candidates.embed_pool(problem, density.rows)


def _require(part: Part | None, name: str, made_by: str) -> Part:
    if part is None:
        raise ValueError(f"{name} must be those of a trained model, got None: train one and pass {made_by}")
    return part


def _identity(x: Tensor) -> Tensor:
    return x


def _excess(problem: Problem, x: Tensor) -> Tensor:
    if problem.largest_y >= 1:
        return torch.zeros_like(x[:, 0])
    return (problem.known_latents().means(x)[1] - problem.largest_y).clamp_min(0)
