"""Which latent paths and which trajectories a controller leads to, as distributions instead of means."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol, runtime_checkable

import torch
from jaxtyping import Float
from scipy.linalg import hadamard
from torch import Tensor

from svaedc.model.config import ModelConfig
from svaedc.model.distributions import Diagonal

# A distribution is a row [location | log scale] of twice as many numbers as it has dimensions.


def gaussian(p: Float[Tensor, "*p n dd"], q: Float[Tensor, "*q m dd"]) -> Float[Tensor, "*pq n m"]:
    r"""KL(p_i || q_j) = 1/2 \sum_d [(s_i^2 + (\mu_i - \mu_j)^2) / s_j^2 - 1 - log(s_i^2 / s_j^2)].

    The squares are multiplied out, so that all pairs cost three matrix products.

    Args:
        p: Rows [mean | log standard deviation], [*p, n, 2 d].
        q: Such rows, [*q, m, 2 d].

    Returns:
        All pairs, [*pq, n, m], at least 0.
    """
    (mu_p, log_p), (mu_q, log_q) = p.chunk(2, dim=-1), q.chunk(2, dim=-1)
    # Locations around a common point: the products then cancel no digits that matter.
    center = mu_q.mean(dim=-2, keepdim=True)
    mu_p, mu_q = mu_p - center, mu_q - center
    precision = torch.exp(-2 * log_q)
    second_moment = torch.exp(2 * log_p) + mu_p.square()
    quadratic = second_moment @ precision.mT - 2 * mu_p @ (mu_q * precision).mT
    of_p = -2 * log_p.sum(-1)[..., :, None] - mu_p.shape[-1]
    of_q = (mu_q.square() * precision + 2 * log_q).sum(-1)[..., None, :]
    return 0.5 * (quadratic + of_p + of_q).clamp_min(0)


def laplace(p: Float[Tensor, "*p n dd"], q: Float[Tensor, "*q m dd"]) -> Float[Tensor, "*pq n m"]:
    r"""KL(p_i || q_j) = \sum_d [log(b_j / b_i) + r/b_j + b_i/b_j e^{-r/b_i} - 1] with r = |\mu_i - \mu_j|.

    Args:
        p: Rows [location | log scale], [*p, n, 2 d].
        q: Such rows, [*q, m, 2 d].

    Returns:
        All pairs, [*pq, n, m], at least 0.
    """
    (mu_p, log_p), (mu_q, log_q) = p.unsqueeze(-2).chunk(2, dim=-1), q.unsqueeze(-3).chunk(2, dim=-1)
    distance = (mu_p - mu_q).abs()
    each = (
        (log_q - log_p)
        + distance * torch.exp(-log_q)
        + torch.exp(log_p - log_q - distance * torch.exp(-log_p))
        - 1
    )
    return each.sum(-1).clamp_min(0)


Divergence = Callable[[Tensor, Tensor], Tensor]
"""It returns KL(p_i || q_j) of all pairs of rows [location | log scale]."""

STEPS: Final = 10
"""BBK-KL compares so many evenly spaced steps of a trajectory: neighbouring ones repeat each other, and alpha
absorbs the common factor that D loses."""
BLOCK: Final = 250
"""So many controllers are decoded at once, so that memory does not grow with the pool."""
_LEAST_VARIANCE: Final = 1e-12
_DIVERGENCES: Final = {"laplace": laplace, "gaussian": gaussian}


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
            xi=Density(lambda x: trajectory_rows(model, x), gaussian),
        )


def latent_rows(model: Generative, x: Float[Tensor, "n D"]) -> Float[Tensor, "n rows"]:
    """Compute p(tau|x) as [location | log scale].

    Args:
        model: Frozen, in evaluation mode.
        x: Controllers in the unit cube, [n, D].

    Returns:
        Rows [n, 2 d], float64; d elements of the latent path, flattened.
    """
    q = model.prior(x.float())
    (loc, _), (scale, _) = model.split(q.loc), model.split(q.scale)
    return torch.cat([loc, scale.log()], dim=-1).double()


def trajectory_rows(model: Generative, x: Float[Tensor, "n D"]) -> Float[Tensor, "n rows"]:
    r"""The moments of p(xi|x) = \int p(xi|tau) p(tau|x) d tau as [mean | log standard deviation].

    E[xi] is the mean of the decoded locations, Var[xi] = E[Var[xi|tau]] + Var[E[xi|tau]], over latent paths
    that have the mean and the covariance of p(tau|x), so both are exact for a linear decoder. They are always
    the same ones, because fresh ones would make k(x, x) differ from 1.

    Args:
        model: Frozen, in evaluation mode.
        x: Controllers in the unit cube, [n, D].

    Returns:
        Rows [n, 2 d], float64; d observations times at most `STEPS` steps, flattened.
    """
    return torch.cat([_moments(model, block) for block in x.float().split(BLOCK)])


def _moments(model: Generative, x: Float[Tensor, "n D"]) -> Float[Tensor, "n rows"]:
    q = model.prior(x)
    (mean, _), (spread, _) = model.split(q.loc), model.split(q.variance.sqrt())
    decoded = [model.p_xi(mean + spread * corner) for corner in _corners(mean.shape[1]).to(mean)]
    loc = torch.stack([_thin(each.loc) for each in decoded])
    variance = torch.stack([_thin(each.variance) for each in decoded])
    total = variance.mean(dim=0) + loc.var(dim=0, correction=0)
    return torch.cat([loc.mean(dim=0), 0.5 * total.clamp_min(_LEAST_VARIANCE).log()], dim=-1)


def _corners(dimensions: int) -> Float[Tensor, "points dimensions"]:
    """Corners of a cube, each with its opposite, whose mean is 0 and whose covariance is 1.

    Columns of a Hadamard matrix are orthogonal to each other and, but for the first, to the constant.
    """
    signs = torch.tensor(hadamard(1 << dimensions.bit_length())[:, 1 : dimensions + 1])
    return torch.cat([signs, -signs]).float()


def _thin(xi: Float[Tensor, "n obs time"]) -> Float[Tensor, "n elements"]:
    steps = torch.linspace(0, xi.shape[2] - 1, min(STEPS, xi.shape[2])).round().long()
    return xi[:, :, steps].double().flatten(1)
