r"""Gaussian processes that expect of a robot what simulation showed.

    f(x) = a \bar f(x) + b + g(x)

\bar f is the mean objective over the simulated worlds, a ~ N(1, `TRUST`^2) how far it is to be trusted, b ~
N(0, `SHIFT`^2) by how much everything is better or worse than simulated, g a process on x or on latent paths.
a and b are not fitted to a handful of trials but integrated out: they are terms of the kernel. A mean from
simulation is that of Cully et al. (Nature 2015); there a is 1 and b 0.

The ensemble takes the robot for one more world, drawn as the simulated ones were:

    f(x) = \bar f(x) + sum_j w_j (f_j(x) - \bar f(x)) + b + g(x),  w_j ~ N(0, 1/e),

so that a trial tells which worlds the robot is like, and through them what other candidates will do.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final

import torch
from gpytorch.kernels import Kernel
from gpytorch.means import Mean
from torch import Tensor

from svaedc.bo.candidates import Candidates, Problem, as_they_are, by_latents
from svaedc.bo.features import Embedding, svae, svae_dc
from svaedc.bo.gp import fit, scale_objectives
from svaedc.bo.kernels import Embedded
from svaedc.bo.surrogates import KernelOf, Surrogate

TRUST: Final = 0.5
"""Standard deviation of a."""
SHIFT: Final = 0.25
"""Standard deviation of b, in parts of the range of objectives."""

Worlds = Callable[[Tensor], Tensor]
"""It takes the simulated objectives [..., n, e] out of rows of features."""


class SimulatedMean(Mean):
    r"""The mean \bar f(x).

    Args:
        worlds: Takes the simulated objectives out of rows of features.
    """

    def __init__(self, worlds: Worlds) -> None:
        super().__init__()
        self._worlds = worlds

    def forward(self, x: Tensor) -> Tensor:
        """Means [..., n] of rows of features [..., n, k + e]."""
        return self._worlds(x).mean(dim=-1)


class Trusted(Kernel):
    r"""The covariance of a \bar f + b: TRUST^2 \bar f \bar f' + SHIFT^2.

    Args:
        worlds: Takes the simulated objectives out of rows of features.
    """

    def __init__(self, worlds: Worlds) -> None:
        super().__init__()
        self._worlds = worlds

    def forward(self, x1: Tensor, x2: Tensor, diag: bool = False, **_: Any) -> Tensor:  # noqa: FBT001, FBT002
        """Compute the kernel matrix, as GPyTorch calls it.

        Args:
            x1: Rows of features, [..., n, k + e].
            x2: Such rows, [..., m, k + e].
            diag: Whether only the diagonal is asked for.
            **_: Not used.

        Returns:
            The matrix, [..., n, m], or its diagonal, [..., n].
        """
        one, other = (TRUST * self._worlds(x).mean(dim=-1) for x in (x1, x2))
        product = one * other if diag else one.unsqueeze(-1) * other.unsqueeze(-2)
        return product + SHIFT**2


class Ensemble(Kernel):
    r"""The covariance of sum_j w_j (f_j - \bar f) + b: that of the worlds, and SHIFT^2.

    Args:
        worlds: Takes the simulated objectives out of rows of features.
    """

    def __init__(self, worlds: Worlds) -> None:
        super().__init__()
        self._worlds = worlds

    def forward(self, x1: Tensor, x2: Tensor, diag: bool = False, **_: Any) -> Tensor:  # noqa: FBT001, FBT002
        """Compute the kernel matrix, as GPyTorch calls it.

        Args:
            x1: Rows of features, [..., n, k + e].
            x2: Such rows, [..., m, k + e].
            diag: Whether only the diagonal is asked for.
            **_: Not used.

        Returns:
            The matrix, [..., n, m], or its diagonal, [..., n].
        """
        one, other = (_deviations(self._worlds(x)) for x in (x1, x2))
        product = (one * other).sum(dim=-1) if diag else one @ other.mT
        return product / one.shape[-1] + SHIFT**2


def _deviations(f: Tensor) -> Tensor:
    return f - f.mean(dim=-1, keepdim=True)


def on_controllers(prior: type[Trusted] | type[Ensemble], kernel: KernelOf, problem: Problem) -> Surrogate:
    """The simulated objective as prior mean, and k_0 on x.

    Args:
        prior: How the simulations are trusted.
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with simulated outcomes.

    Returns:
        The surrogate.
    """
    return _surrogate(as_they_are(problem), prior, kernel, problem)


def on_paths(prior: type[Trusted] | type[Ensemble], kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""The simulated objective as prior mean, and k_0 on \bar\tau.

    Args:
        prior: How the simulations are trusted.
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with simulated outcomes and latents.

    Returns:
        The surrogate.
    """
    return _on_latents(svae, prior, kernel, problem)


def on_compressed_paths(
    prior: type[Trusted] | type[Ensemble], kernel: KernelOf, problem: Problem
) -> Surrogate:
    r"""The simulated objective as prior mean, and k_0 on (1 - \bar y) \bar\tau.

    Args:
        prior: How the simulations are trusted.
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with simulated outcomes and the latents of an SVAE-DC.

    Returns:
        The surrogate.
    """
    problem.known_badness()
    return _on_latents(svae_dc, prior, kernel, problem)


def _on_latents(
    embedding: Embedding, prior: type[Trusted] | type[Ensemble], kernel: KernelOf, problem: Problem
) -> Surrogate:
    problem.known_outcomes()
    return _surrogate(by_latents(problem, embedding), prior, kernel, problem)


def _surrogate(
    compared: Candidates, prior: type[Trusted] | type[Ensemble], kernel: KernelOf, problem: Problem
) -> Surrogate:
    dimensions = compared.phi.shape[1]

    def worlds(rows: Tensor) -> Tensor:
        return rows[..., dimensions:]

    def covariance() -> Kernel:
        return Embedded(kernel(dimensions), lambda rows: rows[..., :dimensions]) + prior(worlds)

    candidates = _with_simulations(compared, problem)
    process = partial(fit, covariance, mean=lambda: SimulatedMean(worlds))
    return Surrogate(candidates, process, problem.objective_limits)


def _with_simulations(candidates: Candidates, problem: Problem) -> Candidates:
    """The same pool; its features have the scaled objectives of all worlds behind them."""
    simulated = problem.known_outcomes()

    def embed(x: Tensor) -> Tensor:
        f = scale_objectives(simulated.objectives(x).double(), problem.objective_limits)
        return torch.cat([candidates.features_of(x), f], dim=1)

    return replace(candidates, phi=embed(torch.tensor(candidates.x).double()), embed=embed, unit=1.0)
