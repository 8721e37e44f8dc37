"""How different two distributions are: Kullback-Leibler divergences of all pairs, on plain tensors."""

import torch
from jaxtyping import Float
from torch import Tensor

# A distribution is a row [location | log scale] of twice as many numbers as it has dimensions.


def gaussian(p: Float[Tensor, "*p n dd"], q: Float[Tensor, "*q m dd"]) -> Float[Tensor, "*pq n m"]:
    r"""KL(p_i || q_j) = 1/2 \sum_d [(s_i^2 + (\mu_i - \mu_j)^2) / s_j^2 - 1 - log(s_i^2 / s_j^2)].

    The squares are multiplied out, so that all pairs cost three matrix products.
    """
    (mu_p, log_p), (mu_q, log_q) = p.chunk(2, dim=-1), q.chunk(2, dim=-1)
    # Locations around a common point: the products then cancel no digits that matter.
    centre = mu_q.mean(dim=-2, keepdim=True)
    mu_p, mu_q = mu_p - centre, mu_q - centre
    precision = torch.exp(-2 * log_q)
    second_moment = torch.exp(2 * log_p) + mu_p.square()
    quadratic = second_moment @ precision.mT - 2 * mu_p @ (mu_q * precision).mT
    of_p = -2 * log_p.sum(-1)[..., :, None] - mu_p.shape[-1]
    of_q = (mu_q.square() * precision + 2 * log_q).sum(-1)[..., None, :]
    return 0.5 * (quadratic + of_p + of_q).clamp_min(0)


def laplace(p: Float[Tensor, "*p n dd"], q: Float[Tensor, "*q m dd"]) -> Float[Tensor, "*pq n m"]:
    r"""KL(p_i || q_j) = \sum_d [log(b_j / b_i) + r/b_j + b_i/b_j e^{-r/b_i} - 1] with r = |\mu_i - \mu_j|."""
    (mu_p, log_p), (mu_q, log_q) = p.unsqueeze(-2).chunk(2, dim=-1), q.unsqueeze(-3).chunk(2, dim=-1)
    distance = (mu_p - mu_q).abs()
    each = (
        (log_q - log_p)
        + distance * torch.exp(-log_q)
        + torch.exp(log_p - log_q - distance * torch.exp(-log_p))
        - 1
    )
    return each.sum(-1).clamp_min(0)
