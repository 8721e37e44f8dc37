"""The controllers a method may suggest, with the features its kernel compares."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import torch
from jaxtyping import Float, Float32, Int
from torch import Tensor

from svaedc.features import Embedding, Latents
from svaedc.history import History


@dataclass(frozen=True, eq=False)
class Problem:
    """What the methods of one run share.

    Attributes:
        dimensions: D, the number of controller parameters.
        objective_limits: Objectives that count as 0 and 1, fixed per setup and never taken from the run.
        pool: Random controllers in the unit cube, fresh per run; may be empty ([0, D]) where no method needs
            one.
        latents: What the frozen model says of the pool, for methods that need it.
    """

    dimensions: int
    objective_limits: tuple[float, float]
    pool: Float32[np.ndarray, "n D"]
    latents: Latents | None = None

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
        """The latents.

        Raises:
            ValueError: There are none.
        """
        if self.latents is None:
            raise ValueError(
                "latents must be those of a trained model, got None: "
                "train one and pass Latents.of(pool, model.latent_means)"
            )
        return self.latents

    def least_bad(self, share: float) -> "Problem":
        """The same problem with only this share of the pool, the controllers predicted least bad."""
        latents = self.known_latents()
        kept = torch.argsort(latents.y, stable=True)[: math.ceil(share * len(self.pool))]
        screened = replace(latents, tau=latents.tau[kept], y=latents.y[kept])
        return replace(self, pool=self.pool[kept.numpy()], latents=screened)


@dataclass(frozen=True, eq=False)
class Candidates:
    """Controllers and their features in units of their typical distance.

    Dividing by one number leaves the kernels as the paper has them and gives every kernel the same unit of
    lengthscale, so that one range of lengthscales fits controllers and latent paths of any model.

    Attributes:
        x: The controllers.
        phi: Their features divided by `unit`, float64.
        embed: Features of any controllers (float64, [n, D]), not yet divided.
        unit: Root-mean-square distance between the features of two candidates.
    """

    x: Float32[np.ndarray, "n D"]
    phi: Float[Tensor, "n k"]
    embed: Callable[[Tensor], Tensor]
    unit: float

    @classmethod
    def of(
        cls, x: Float32[np.ndarray, "n D"], phi: Float[Tensor, "n k"], embed: Callable[[Tensor], Tensor]
    ) -> "Candidates":
        """Candidates with these features.

        Raises:
            ValueError: There are none.
        """
        if not len(x):
            raise ValueError("a method that searches a pool needs one, got 0 controllers: draw at least one")
        unit = math.sqrt(2 * float(phi.var(dim=0, correction=0).sum())) or 1.0
        return cls(x, phi / unit, embed, unit)

    def features_of(self, x: Float[np.ndarray, "t D"]) -> Float[Tensor, "t k"]:
        """Features of any controllers, in the same unit."""
        return self.embed(torch.tensor(x)) / self.unit

    def untried(self, history: History) -> Int[np.ndarray, " u"]:
        """Indices of the candidates no trial was spent on.

        Raises:
            ValueError: There are none left.
        """
        tried = np.zeros(len(self.x), dtype=bool)
        for x in history.tried.astype(np.float32):
            tried |= (self.x == x).all(axis=1)
        if tried.all():
            raise ValueError(f"all {len(self.x)} candidates have been tried: draw a larger pool")
        return np.flatnonzero(~tried)


def as_they_are(problem: Problem) -> Candidates:
    """The pool, compared by controller parameters: phi(x) = x."""
    return Candidates.of(problem.pool, torch.tensor(problem.pool).double(), lambda x: x)


def by_latents(problem: Problem, embedding: Embedding) -> Candidates:
    """The pool, compared by latent paths: phi(x) = embedding(tau of x, y of x)."""
    latents = problem.known_latents()
    phi = embedding(latents.tau, latents.y)
    return Candidates.of(problem.pool, phi, lambda x: embedding(*latents.means(x)))
