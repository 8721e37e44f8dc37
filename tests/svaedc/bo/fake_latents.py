"""A stand-in for the trained model: latent paths linear in x, a smooth badness, and distributions of both."""

import numpy as np
import torch

from svaedc.bo import distribution_features
from svaedc.bo.candidates import Problem
from svaedc.bo.distribution_features import Densities, Density
from svaedc.bo.features import Latents
from svaedc.bo.online import Adjustable
from svaedc.bo.simulated.outcomes import Lookup, SimulatedOutcomes

TAU_DIMENSIONS = 3


def latent_means(x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """tau = (x - 1/2) A with a fixed A, y = sigmoid(6 (x_0 - 1/2)): large x_0 is bad."""
    a = torch.linspace(-1, 1, x.shape[1] * TAU_DIMENSIONS, dtype=x.dtype).cos().reshape(x.shape[1], -1)
    return (x - 0.5) @ (a + torch.eye(x.shape[1], TAU_DIMENSIONS, dtype=x.dtype)), torch.sigmoid(
        6 * (x[:, 0] - 0.5)
    )


class FakeModel(torch.nn.Module):
    """The same with a last layer that could be adjusted: tau = L tau(x) with L the identity."""

    def __init__(self) -> None:
        super().__init__()
        self.last = torch.nn.Linear(TAU_DIMENSIONS, TAU_DIMENSIONS, bias=False).requires_grad_(False)
        self.last.weight.copy_(torch.eye(TAU_DIMENSIONS))

    def latent_means(self, x: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
        tau, y = latent_means(x)
        return self.last(tau), y


def rows(x: torch.Tensor) -> torch.Tensor:
    """[location | log scale]: located at tau, wider where x_1 is large."""
    tau = latent_means(x.double())[0]
    return torch.cat([tau, (x.double()[:, 1:2] - 1).expand_as(tau)], dim=-1)


class EverywhereSimulated(SimulatedOutcomes):
    """Three worlds in which any controller was simulated: each world has its own optimum."""

    def objectives(self, x: torch.Tensor) -> torch.Tensor:
        return torch.stack([1 - (x - center).square().sum(dim=1) for center in (0.2, 0.3, 0.5)], dim=1)

    def badness(self, x: torch.Tensor) -> torch.Tensor:
        return latent_means(x)[1][:, None].expand(-1, 3)


def problem(dimensions: int, candidates: int, seed: int) -> Problem:
    """A run's problem with a random pool, its fake latents and outcomes, objectives between -1 and 1."""
    pool = np.random.default_rng(seed).random((candidates, dimensions), dtype=np.float32)
    latents = Latents.of(torch.tensor(pool), latent_means)
    densities = Densities(
        tau=Density(rows, distribution_features.laplace), xi=Density(rows, distribution_features.gaussian)
    )
    adjustable = Adjustable(FakeModel(), layers=("last.weight",))
    nothing = torch.zeros(1, 1)
    simulated = EverywhereSimulated(nothing, nothing, Lookup(pool))
    return Problem(dimensions, (-1.0, 1.0), pool, latents, densities, adjustable, simulated=simulated)


def quadratic(x: np.ndarray) -> float:
    """1 at x = 0.3, falling with the squared distance."""
    return float(1 - 4 * ((x.astype(float) - 0.3) ** 2).sum())
