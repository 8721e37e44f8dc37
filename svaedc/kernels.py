"""How alike two controllers are: the paper's kernels, composed from GPyTorch's."""

from typing import Any

from gpytorch.constraints import Interval
from gpytorch.kernels import Kernel, MaternKernel, RBFKernel, ScaleKernel
from jaxtyping import Float
from torch import Tensor

from svaedc.features import LatentMeans, svae_dc

OUTPUT_SCALE = (0.1, 1.0)
"""Range of sigma_k^2 for an objective scaled to [0, 1]."""
LENGTHSCALE = (0.1, 10.0)
"""Range of each lengthscale for features whose root-mean-square distance is 1."""


def se(lengthscales: int) -> ScaleKernel:
    r"""k_SE(r) = \sigma_k^2 exp(-1/2 r^T diag(\ell)^{-2} r), section 4 of the paper.

    Args:
        lengthscales: 1 for one shared by all dimensions, or their number (ARD).
    """
    return _scaled(RBFKernel(ard_num_dims=_ard(lengthscales), lengthscale_constraint=_lengthscale()))


def matern(lengthscales: int) -> ScaleKernel:
    r"""k_Matern52(r) = \sigma_k^2 (1 + \sqrt5 d + 5/3 d^2) exp(-\sqrt5 d) with d = |r / \ell|, section 4.

    Args:
        lengthscales: 1 for one shared by all dimensions, or their number (ARD).
    """
    return _scaled(
        MaternKernel(nu=2.5, ard_num_dims=_ard(lengthscales), lengthscale_constraint=_lengthscale())
    )


class SvaeDc(Kernel):
    r"""k(x_i, x_j) = k_0(phi(x_i), phi(x_j)) with phi(x) = (1 - \bar y_x) \bar\tau_x, equation (k_svae_dc).

    The form on controllers, for search off a pool; with a pool, phi is computed once and k_0 is enough.

    Args:
        outer: k_0, `se(...)` or `matern(...)`.
        latent_means: The frozen model's (tau, y) of controllers. A function and not a submodule, so that
            fitting hyper-parameters cannot move its weights nor switch it to training mode.
    """

    def __init__(self, outer: Kernel, latent_means: LatentMeans) -> None:
        super().__init__()
        self.outer = outer
        self.latent_means = latent_means

    def phi(self, x: Float[Tensor, "*batch n D"]) -> Float[Tensor, "*batch n k"]:
        r"""(1 - \bar y_x) \bar\tau_x."""
        tau, y = self.latent_means(x.reshape(-1, x.shape[-1]))
        return svae_dc(tau, y).to(x.dtype).reshape(*x.shape[:-1], -1)

    def forward(self, x1: Tensor, x2: Tensor, **params: Any) -> Any:
        """The kernel matrix [..., n, m] of x1 [..., n, D] and x2 [..., m, D], as GPyTorch calls it."""
        return self.outer.forward(self.phi(x1), self.phi(x2), **params)


def _scaled(kernel: Kernel) -> ScaleKernel:
    return ScaleKernel(kernel, outputscale_constraint=Interval(*OUTPUT_SCALE, initial_value=0.5))


def _lengthscale() -> Interval:
    return Interval(*LENGTHSCALE, initial_value=1.0)


def _ard(lengthscales: int) -> int | None:
    if lengthscales < 1:
        raise ValueError(f"a kernel needs at least 1 lengthscale, got {lengthscales}")
    return lengthscales if lengthscales > 1 else None
