"""Which latent paths and which trajectories a controller leads to, as distributions instead of means."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import torch
from jaxtyping import Float
from torch import Tensor
from torch.quasirandom import SobolEngine

from svaedc import divergences
from svaedc.architecture import ModelConfig
from svaedc.distributions import Diagonal

Divergence = Callable[[Tensor, Tensor], Tensor]
"""KL(p_i || q_j) of all pairs of rows [location | log scale]."""

PAIRS: Final = 8
"""Antithetic pairs of latent paths that the moments of p(xi|x) come from; always the same ones, because fresh
ones would make k(x, x) differ from 1."""
STEPS: Final = 10
"""Evenly spaced steps of a trajectory that BBK-KL compares: neighbouring ones repeat each other, and alpha
absorbs the common factor that D loses."""
BLOCK: Final = 250
"""Controllers decoded at once, so that memory does not grow with the pool."""
_LEAST_VARIANCE: Final = 1e-12
_DIVERGENCES: Final = {"laplace": divergences.laplace, "gaussian": divergences.gaussian}


@runtime_checkable
class Generative(Protocol):
    """What is asked of a trained model."""

    config: ModelConfig

    def prior(self, x: Tensor) -> Diagonal:
        """p(tau, psi | x)."""
        ...

    def split(self, code: Tensor) -> tuple[Tensor, Tensor]:
        """[tau, psi] into its two parts."""
        ...

    def p_xi(self, tau: Tensor) -> Diagonal:
        """p(xi | tau), event `[obs, time]`."""
        ...


@dataclass(frozen=True, eq=False)
class Density:
    """A distribution for every controller, as rows that a kernel can compare.

    Attributes:
        rows: [location | log scale] of controllers [n, D], float64; gradients reach the controllers.
        divergence: KL of all pairs of such rows.
    """

    rows: Callable[[Tensor], Tensor]
    divergence: Divergence


@dataclass(frozen=True, eq=False)
class Densities:
    """The two distributions that the KL kernels compare.

    Attributes:
        tau: p(tau|x), of the model's own family.
        xi: p(xi|x), as the Gaussian with its moments: it has no closed form.
    """

    tau: Density
    xi: Density

    @classmethod
    def of(cls, model: Generative) -> "Densities":
        """Those of a trained model, which should be frozen and in evaluation mode."""
        return cls(
            tau=Density(lambda x: latent_rows(model, x), _DIVERGENCES[model.config.distribution]),
            xi=Density(lambda x: trajectory_rows(model, x), divergences.gaussian),
        )


def latent_rows(model: Generative, x: Float[Tensor, "n D"]) -> Float[Tensor, "n rows"]:
    """p(tau|x) as [location | log scale], flattened over the path."""
    q = model.prior(x.float())
    (loc, _), (scale, _) = model.split(q.loc), model.split(q.scale)
    return torch.cat([loc, scale.log()], dim=-1).double()


def trajectory_rows(model: Generative, x: Float[Tensor, "n D"]) -> Float[Tensor, "n rows"]:
    r"""The moments of p(xi|x) = \int p(xi|tau) p(tau|x) d tau as [mean | log standard deviation].

    E[xi] is the mean of the decoded locations, Var[xi] = E[Var[xi|tau]] + Var[E[xi|tau]], over latent paths
    at fixed antithetic quantiles of p(tau|x).
    """
    return torch.cat([_moments(model, block) for block in x.float().split(BLOCK)])


def _moments(model: Generative, x: Float[Tensor, "n D"]) -> Float[Tensor, "n rows"]:
    q = model.prior(x)
    u = SobolEngine(q.loc.shape[1], scramble=True, seed=0).draw(PAIRS)
    decoded = [model.p_xi(model.split(q.quantile(each))[0]) for each in torch.cat([u, 1 - u])]
    loc = torch.stack([_thinned(each.loc) for each in decoded])
    variance = torch.stack([_thinned(each.variance) for each in decoded])
    total = variance.mean(dim=0) + loc.var(dim=0, correction=0)
    return torch.cat([loc.mean(dim=0), 0.5 * total.clamp_min(_LEAST_VARIANCE).log()], dim=-1)


def _thinned(xi: Float[Tensor, "n obs time"]) -> Float[Tensor, "n elements"]:
    steps = torch.linspace(0, xi.shape[2] - 1, min(STEPS, xi.shape[2])).round().long()
    return xi[:, :, steps].double().flatten(1)
