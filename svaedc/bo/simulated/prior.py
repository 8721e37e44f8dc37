r"""Gaussian processes that expect of a robot what simulation showed.

    f(x) = a \bar f(x) + b + c s(x) + d \bar y(x) + g(x)

\bar f is the mean objective over the simulated worlds, s its spread, \bar y the mean badness. a ~ N(1,
`TRUST`^2) says how far simulation is to be trusted, b ~ N(0, `SHIFT`^2) by how much everything is better or
worse than simulated, c and d ~ N(0, `TRUST`^2) what it costs on this robot that a candidate depends on luck
or is bad. g is a process on x or on latent paths. a to d are not fitted to a handful of trials but
integrated out: they are terms of the kernel. A mean from simulation is that of Cully et al. (Nature 2015);
there a is 1, and b to d are 0.

The ensemble takes the robot for one more world, drawn as the simulated ones were:

    f(x) = \bar f(x) + sum_j w_j (f_j(x) - \bar f(x)) + b + g(x),  w_j ~ N(0, 1/e),

so that a trial tells which worlds the robot is like, and through them what other candidates will do.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any, Final, NamedTuple

import torch
from gpytorch.kernels import Kernel
from gpytorch.means import Mean
from torch import Tensor

from svaedc.bo.candidates import Candidates, Problem, as_they_are, by_latents
from svaedc.bo.features import Embedding, svae, svae_dc
from svaedc.bo.gp import fit, scale_objectives
from svaedc.bo.kernels import Embedded
from svaedc.bo.simulated.outcomes import spread
from svaedc.bo.surrogates import KernelOf, Surrogate

TRUST: Final = 0.5
"""Standard deviation of a, c and d."""
SHIFT: Final = 0.25
"""Standard deviation of b, in parts of the range of objectives."""


class Worlds(NamedTuple):
    """What simulation showed, taken out of rows of features.

    Attributes:
        f: Objectives in parts of their range, [..., n, e].
        y: Badness, [..., n, e].
    """

    f: Tensor
    y: Tensor


WorldsOf = Callable[[Tensor], Worlds]


class SimulatedMean(Mean):
    r"""The mean \bar f(x) - caution s(x).

    Args:
        worlds: Takes what simulation showed out of rows of features.
        caution: Weight of the spread s.
    """

    def __init__(self, worlds: WorldsOf, caution: float = 0.0) -> None:
        super().__init__()
        self._worlds, self._caution = worlds, caution

    def forward(self, x: Tensor) -> Tensor:
        """Means [..., n] of rows of features [..., n, k + 2 e]."""
        f = self._worlds(x).f
        return f.mean(dim=-1) - self._caution * spread(f)


Regressors = Callable[[Worlds], Tensor]
"""It gives what random weights belong to, each times the standard deviation of its weight, [..., n, r]."""


class LinearKernel(Kernel):
    """The covariance of a linear function of what simulation showed, with random weights, and of b.

    Args:
        worlds: Takes what simulation showed out of rows of features.
        regressors: What the weights belong to.
    """

    def __init__(self, worlds: WorldsOf, regressors: Regressors) -> None:
        super().__init__()
        self._worlds = worlds
        self._regressors = regressors

    def forward(self, x1: Tensor, x2: Tensor, diag: bool = False, **_: Any) -> Tensor:  # noqa: FBT001, FBT002
        """Compute the kernel matrix, as GPyTorch calls it.

        Args:
            x1: Rows of features, [..., n, k + 2 e].
            x2: Such rows, [..., m, k + 2 e].
            diag: Whether only the diagonal is asked for.
            **_: Not used.

        Returns:
            The matrix, [..., n, m], or its diagonal, [..., n].
        """
        one, other = (self._regressors(self._worlds(x)) for x in (x1, x2))
        return ((one * other).sum(dim=-1) if diag else one @ other.mT) + SHIFT**2


def trust(worlds: Worlds) -> Tensor:
    r"""Regressors of a \bar f + b + c s + d \bar y: mean objective, its spread, mean badness."""
    return TRUST * torch.stack([worlds.f.mean(dim=-1), spread(worlds.f), worlds.y.mean(dim=-1)], dim=-1)


def ensemble(worlds: Worlds) -> Tensor:
    r"""Regressors of sum_j w_j (f_j - \bar f) + b: how each world differs from their mean."""
    return (worlds.f - worlds.f.mean(dim=-1, keepdim=True)) / worlds.f.shape[-1] ** 0.5


def on_controllers(prior: Regressors, kernel: KernelOf, problem: Problem) -> Surrogate:
    """The simulated objective as prior mean, and k_0 on x.

    Args:
        prior: How the simulations are trusted.
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with simulated outcomes.

    Returns:
        The surrogate.
    """
    return _surrogate(as_they_are(problem), prior, kernel, problem)


def on_paths(prior: Regressors, kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""The simulated objective as prior mean, and k_0 on \bar\tau.

    Args:
        prior: How the simulations are trusted.
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with simulated outcomes and latents.

    Returns:
        The surrogate.
    """
    return _on_latents(svae, prior, kernel, problem)


def on_compressed_paths(prior: Regressors, kernel: KernelOf, problem: Problem) -> Surrogate:
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


def _on_latents(embedding: Embedding, prior: Regressors, kernel: KernelOf, problem: Problem) -> Surrogate:
    problem.known_outcomes()
    return _surrogate(by_latents(problem, embedding), prior, kernel, problem)


def _surrogate(compared: Candidates, prior: Regressors, kernel: KernelOf, problem: Problem) -> Surrogate:
    dimensions = compared.phi.shape[1]
    features, worlds = worlds_behind(dimensions)
    process = partial(
        fit,
        lambda: Embedded(kernel(dimensions), features) + LinearKernel(worlds, prior),
        mean=lambda: SimulatedMean(worlds),
    )
    return Surrogate(with_simulations(compared, problem), process, problem.objective_limits)


def worlds_behind(dimensions: int) -> tuple[Callable[[Tensor], Tensor], WorldsOf]:
    """Two functions of rows of `with_simulations`: to their features, and to what simulation showed."""

    def features(rows: Tensor) -> Tensor:
        return rows[..., :dimensions]

    def worlds(rows: Tensor) -> Worlds:
        return Worlds(*rows[..., dimensions:].chunk(2, dim=-1))

    return features, worlds


def with_simulations(candidates: Candidates, problem: Problem) -> Candidates:
    """Put the scaled objectives and the badness in all worlds behind the features of a pool.

    Args:
        candidates: The pool.
        problem: With simulated outcomes of all its candidates.

    Returns:
        The same pool, with rows of features [k + 2 e].
    """
    simulated = problem.known_outcomes()

    def embed(x: Tensor) -> Tensor:
        f = scale_objectives(simulated.objectives(x).double(), problem.objective_limits)
        return torch.cat([candidates.features_of(x), f, simulated.badness(x).double()], dim=1)

    return replace(candidates, phi=embed(torch.tensor(candidates.x).double()), embed=embed, unit=1.0)
