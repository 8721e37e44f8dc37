"""How alike two controllers are: the paper's kernels over features, composed from GPyTorch's."""

from collections.abc import Callable
from typing import Any

import torch
from gpytorch.constraints import Interval
from gpytorch.kernels import Kernel, MaternKernel, RBFKernel, ScaleKernel
from torch import Tensor

from svaedc.bo.distribution_features import Divergence
from svaedc.bo.features import Embedding

OUTPUT_SCALE = (0.1, 1.0)
"""sigma_k^2 lies in this range, for an objective scaled to [0, 1]."""
LENGTHSCALE = (0.1, 10.0)
"""Each lengthscale lies in this range, for features whose root-mean-square distance is 1."""
JITTER = 1e-6
"""The smallest eigenvalue of a KL kernel's matrix of trials is kept at least so far above zero."""


def se(lengthscales: int) -> ScaleKernel:
    r"""k_SE(r) = \sigma_k^2 exp(-1/2 r^T diag(\ell)^{-2} r), section 4 of the paper.

    Args:
        lengthscales: 1 for one shared by all dimensions, or their number (ARD).
    """
    return _scale(RBFKernel(ard_num_dims=_ard(lengthscales), lengthscale_constraint=_lengthscale()))


def matern(lengthscales: int) -> ScaleKernel:
    r"""k_Matern52(r) = \sigma_k^2 (1 + \sqrt5 d + 5/3 d^2) exp(-\sqrt5 d) with d = |r / \ell|, section 4.

    Args:
        lengthscales: 1 for one shared by all dimensions, or their number (ARD).
    """
    return _scale(
        MaternKernel(nu=2.5, ard_num_dims=_ard(lengthscales), lengthscale_constraint=_lengthscale())
    )


def kl(divergence: Divergence, median: float) -> ScaleKernel:
    r"""\sigma_k^2 exp(-\alpha D), equation (BBK-KL): on p(xi|x) it is BBK-KL, on p(tau|x) LKL.

    Args:
        divergence: KL of all pairs of rows.
        median: Of D over simulated controllers; alpha starts at its inverse.

    Returns:
        The kernel; rows [location | log scale] are its inputs.
    """
    return _scale(SymmetrizedKl(divergence, median))


def compressed_kernel(outer: Kernel, embedding: Embedding) -> "Embedded":
    r"""k(x_i, x_j) = k_0(phi(x_i), phi(x_j)) with phi(x) = (1 - \bar y_x) \bar\tau_x, equation (k_svae_dc).

    The whole formula over rows [tau | y]. With a pool that does not change, phi is computed once instead, and
    k_0 on it is the same kernel.

    Args:
        outer: k_0, `se(...)` or `matern(...)`.
        embedding: phi, for example `svae_dc`.

    Returns:
        The kernel; its inputs are rows [tau | y].
    """
    return Embedded(outer, lambda rows: embedding(rows[..., :-1], rows[..., -1]))


class Embedded(Kernel):
    """k(x_i, x_j) = k_0(phi(x_i), phi(x_j)).

    Args:
        outer: k_0, `se(...)` or `matern(...)`.
        phi: Features [..., n, k] of what the kernel is given; a module is fitted together with k_0.
    """

    def __init__(self, outer: Kernel, phi: Callable[[Tensor], Tensor]) -> None:
        super().__init__()
        self.outer = outer
        self.phi = phi

    def forward(self, x1: Tensor, x2: Tensor, **params: Any) -> Any:
        """Compute the kernel matrix, as GPyTorch calls it.

        Args:
            x1: What `phi` takes, [..., n, d].
            x2: The same, [..., m, d].
            **params: Passed on to k_0.

        Returns:
            The matrix, [..., n, m], or what k_0 makes of `params`.
        """
        return self.outer.forward(self.phi(x1), self.phi(x2), **params)


class SymmetrizedKl(Kernel):
    r"""k(x_i, x_j) = exp(-\alpha D) with D = \sqrt{KL(p_i||p_j)} + \sqrt{KL(p_j||p_i)}, equation (BBK-KL).

    Its diagonal is 1. Between distributions of one common scale it is positive definite, but not in general:
    to the matrix of a set of controllers with itself belongs the least multiple of the identity that lifts
    its smallest eigenvalue to `JITTER`.

    Args:
        divergence: KL of all pairs of rows [location | log scale].
        median: Of D over simulated controllers; alpha starts at its inverse.
    """

    def __init__(self, divergence: Divergence, median: float) -> None:
        super().__init__()
        low, high = (each / median for each in LENGTHSCALE)
        self.divergence = divergence
        self.register_parameter("raw_alpha", torch.nn.Parameter(torch.zeros(1, 1)))
        self.register_constraint("raw_alpha", Interval(low, high, initial_value=1 / median))

    @property
    def alpha(self) -> Tensor:
        """Rate at which likeness falls with D."""
        return self.raw_alpha_constraint.transform(self.raw_alpha)

    def forward(self, x1: Tensor, x2: Tensor, diag: bool = False, **_: Any) -> Tensor:  # noqa: FBT001, FBT002
        """Compute the kernel matrix, as GPyTorch calls it.

        Args:
            x1: Rows [location | log scale], [..., n, 2 d].
            x2: Such rows, [..., m, 2 d].
            diag: Whether only the diagonal is asked for.
            **_: Not used.

        Returns:
            The matrix, [..., n, m], or its diagonal, [..., n].
        """
        if diag:
            return torch.ones_like(x1[..., 0])
        likeness = torch.exp(-self.alpha * distance(self.divergence, x1, x2))
        return _positive_definite(likeness) if x1 is x2 or torch.equal(x1, x2) else likeness


def distance(divergence: Divergence, p: Tensor, q: Tensor) -> Tensor:
    r"""D = \sqrt{KL(p||q)} + \sqrt{KL(q||p)} of all pairs of rows.

    Args:
        divergence: KL of all pairs of rows.
        p: Rows [location | log scale], [..., n, 2 d].
        q: Such rows, [..., m, 2 d].

    Returns:
        Distances, [..., n, m]; without a derivative where they are 0.
    """
    return _root(divergence(p, q)) + _root(divergence(q, p).mT)


def _root(kl_divergence: Tensor) -> Tensor:
    # The root has no derivative at zero, where a controller meets itself: there, D counts as constant.
    positive = kl_divergence > torch.finfo(kl_divergence.dtype).eps
    return torch.where(positive, torch.where(positive, kl_divergence, 1.0).sqrt(), 0.0)


def _positive_definite(likeness: Tensor) -> Tensor:
    symmetric = 0.5 * (likeness + likeness.mT)
    identity = torch.eye(symmetric.shape[-1], dtype=symmetric.dtype, device=symmetric.device)
    unit = symmetric * (1 - identity) + identity
    smallest = torch.linalg.eigvalsh(unit.detach()).min(dim=-1).values
    return unit + (JITTER - smallest).clamp_min(0)[..., None, None] * identity


def _scale(kernel: Kernel) -> ScaleKernel:
    return ScaleKernel(kernel, outputscale_constraint=Interval(*OUTPUT_SCALE, initial_value=0.5))


def _lengthscale() -> Interval:
    return Interval(*LENGTHSCALE, initial_value=1.0)


def _ard(lengthscales: int) -> int | None:
    if lengthscales < 1:
        raise ValueError(f"a kernel needs at least 1 lengthscale, got {lengthscales}")
    return lengthscales if lengthscales > 1 else None
