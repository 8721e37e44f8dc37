"""What a kernel compares instead of controllers: latent paths, compressed where the controller is bad."""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from jaxtyping import Float
from torch import Tensor

LatentMeans = Callable[[Tensor], tuple[Tensor, Tensor]]
"""It returns E[tau | x] and the predicted badness of controllers [n, D]."""
Embedding = Callable[[Tensor, Tensor], Tensor]
"""It returns phi(x) of tau [..., k] and y [...]."""

_LEAST_SCALE = 0.1
"""A latent dimension is collapsed below this share of the widest one; whitening
may not blow such noise up to the size of a signal."""


@dataclass(frozen=True, eq=False)
class Latents:
    """What the frozen model says about a pool of controllers, computed once, and about any other.

    Attributes:
        tau: Latent paths E[tau | x] of the pool, flattened.
        y: Predicted badness of the pool, in [0, 1].
        at: The model's `latent_means`: the same two for other controllers (float32, [n, D]).
    """

    tau: Float[Tensor, "n k"]
    y: Float[Tensor, " n"]
    at: LatentMeans

    def __post_init__(self) -> None:
        """Refuses latents that would silently make every kernel value NaN or compress the wrong way."""
        if not torch.isfinite(self.tau).all():
            raise ValueError("tau must be finite, got NaN or infinity: the model has diverged, train it anew")
        if not ((self.y >= 0) & (self.y <= 1)).all():
            raise ValueError(f"y must lie in [0, 1], got {self.y.min():.3g} to {self.y.max():.3g}")

    @classmethod
    def of(cls, pool: Float[Tensor, "n D"], at: LatentMeans) -> "Latents":
        """Compute the latents of a pool.

        Args:
            pool: Controllers in the unit cube, [n, D].
            at: The model's `latent_means`.

        Returns:
            Those of the pool in float64, without gradients; `at` goes along for other controllers.
        """
        with torch.no_grad():
            return cls(*_means(at, pool), at)

    def means(self, x: Float[Tensor, "n D"]) -> tuple[Float[Tensor, "n k"], Float[Tensor, " n"]]:
        """E[tau | x] and the predicted badness of any controllers, in float64; gradients reach x."""
        return _means(self.at, x)


def _means(at: LatentMeans, x: Float[Tensor, "n D"]) -> tuple[Tensor, Tensor]:
    tau, y = at(x.float())
    # The mean of p(y|psi) may overshoot [0, 1], and a negative 1 - y would mirror latent paths.
    return tau.double(), y.double().clamp(0, 1)


def svae(tau: Float[Tensor, "*n k"], y: Float[Tensor, "*n"]) -> Float[Tensor, "*n k"]:  # noqa: ARG001
    r"""phi(x) = \bar\tau_x: the latent path as it is, whatever its badness.

    Args:
        tau: Latent paths, [*n, k].
        y: Not used: badness compresses nothing here.

    Returns:
        Features, [*n, k]: `tau` itself.
    """
    return tau


def svae_dc(tau: Float[Tensor, "*n k"], y: Float[Tensor, "*n"]) -> Float[Tensor, "*n k"]:
    r"""phi(x) = (1 - \bar y_x) \bar\tau_x: dynamic compression, equation (k_svae_dc_dist).

    Args:
        tau: Latent paths, [*n, k].
        y: Predicted badness in [0, 1], [*n].

    Returns:
        Features, [*n, k]; those of the worst controllers meet in the origin.
    """
    return (1 - y).unsqueeze(-1) * tau


@dataclass(frozen=True)
class Sigmoid:
    r"""phi(x) = sigmoid(\alpha((1 - \bar y_x) - c)) \bar\tau_x: non-linear compression (section 4).

    The paper prints sigmoid(alpha(y - c)), which would enlarge what is bad; the authors' code compresses by
    the goodness 1 - y, and so does this. Their constants are the defaults.

    Attributes:
        alpha: Slope.
        c: Goodness at the midpoint.
    """

    alpha: float = 25.0
    c: float = 0.35

    def __post_init__(self) -> None:
        """Refuses a slope that would enlarge what is bad."""
        if not self.alpha > 0:
            raise ValueError(f"alpha must be above 0, got {self.alpha}: a falling slope rewards badness")

    def __call__(self, tau: Float[Tensor, "*n k"], y: Float[Tensor, "*n"]) -> Float[Tensor, "*n k"]:
        """The features of any controllers."""
        return torch.sigmoid(self.alpha * ((1 - y) - self.c)).unsqueeze(-1) * tau


@dataclass(frozen=True, eq=False)
class Whitened:
    r"""phi(x) = (1 - \bar y_x) \bar\tau_x / s: our variant of dynamic compression.

    s holds the standard deviation of each latent dimension over simulated controllers: a fit of lengthscales
    to a handful of trials begins where all dimensions count the same. The latent path is not centred, so that
    bad controllers meet in the origin, as in the paper, and not at the mean controller.

    Attributes:
        s: Scale of each latent dimension.
    """

    s: Float[Tensor, " k"]

    @classmethod
    def over(cls, tau: Float[Tensor, "n k"]) -> "Whitened":
        """The spread of simulated controllers, at least two."""
        spread = tau.std(dim=0)
        return cls(spread.clamp_min(max(_LEAST_SCALE * float(spread.max()), torch.finfo(tau.dtype).tiny)))

    def __call__(self, tau: Float[Tensor, "*n k"], y: Float[Tensor, "*n"]) -> Float[Tensor, "*n k"]:
        """The features of any controllers."""
        return svae_dc(tau / self.s, y)
