"""How promising a controller is, given what a surrogate expects of it."""

import math
from collections.abc import Callable
from typing import Final

import torch
from jaxtyping import Float
from torch import Tensor

BETA: Final = 1.0
"""Weight of the variance in UCB (section 6 of the paper)."""

Acquisition = Callable[[Tensor, Tensor, float], Tensor]
"""Value of a controller: of the mean and standard deviation of its f, and of the largest f measured."""

_FAR_BELOW: Final = -1e3
"""Below, 1 - |z| sqrt(pi/2) erfcx(|z|/sqrt 2) is 1/z^2 to rounding, and the difference would cancel."""


def ucb(mu: Float[Tensor, "*n"], sigma: Float[Tensor, "*n"], best: float) -> Float[Tensor, "*n"]:  # noqa: ARG001
    r"""UCB(x) = \mu(x) + \sqrt\beta \sigma(x) with beta = 1, the root as in BoTorch."""
    return mu + BETA**0.5 * sigma


def log_ei(mu: Float[Tensor, "*n"], sigma: Float[Tensor, "*n"], best: float) -> Float[Tensor, "*n"]:
    r"""LogEI(x) = log E[max(f(x) - best, 0)] = log \sigma + log h(z) with z = (\mu - best) / \sigma.

    Its logarithm, because expected improvement itself is zero in floating point almost everywhere after a few
    trials (Ament et al., NeurIPS 2023).
    """
    return sigma.log() + _log_h((mu - best) / sigma)


def _log_h(z: Tensor) -> Tensor:
    r"""log(\varphi(z) + z \Phi(z)), exact to rounding for every z; each branch sees only its own z."""
    near, middle, far = z > -1, (z <= -1) & (z > _FAR_BELOW), z <= _FAR_BELOW
    z_near, z_middle, z_far = (
        torch.where(branch, z, inside)
        for branch, inside in ((near, 0.0), (middle, -2.0), (far, 2 * _FAR_BELOW))
    )
    log_near = (torch.exp(_log_phi(z_near)) + z_near * torch.special.ndtr(z_near)).log()
    ratio = z_middle * math.sqrt(math.pi / 2) * torch.special.erfcx(-z_middle / math.sqrt(2))
    log_middle = _log_phi(z_middle) + torch.log1p(ratio)
    log_far = _log_phi(z_far) - 2 * torch.log(-z_far)
    return torch.where(near, log_near, torch.where(middle, log_middle, log_far))


def _log_phi(z: Tensor) -> Tensor:
    return -0.5 * z.square() - 0.5 * math.log(2 * math.pi)
