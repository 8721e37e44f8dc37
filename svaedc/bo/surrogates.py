"""What each method believes about f: the features it compares, by which kernel, in which units."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

import torch
from gpytorch.kernels import Kernel
from torch import Tensor

from svaedc.bo import kernels
from svaedc.bo.candidates import Candidates, Problem, as_they_are, by_density, by_latents, in_the_cube
from svaedc.bo.distribution_features import Density
from svaedc.bo.features import Sigmoid, Whitened, svae, svae_dc
from svaedc.bo.gp import Fit, Posterior, fit, scale_objectives
from svaedc.bo.history import History
from svaedc.bo.online import AdjustedPaths

LEAST_BAD: Final = 0.3
"""Screening keeps this share of the pool."""
_FOR_MEDIAN: Final = 100
"""Distances of so many simulated controllers say where alpha starts."""
_AS_MEASURED: Final = (0.0, 1.0)

KernelOf = Callable[[int], Kernel]
"""It makes a kernel with that many lengthscales."""


@dataclass(frozen=True)
class Surrogate:
    """How a method learns from trials.

    Attributes:
        candidates: What may be suggested, with the features that are compared.
        fit: Turns features and objectives of the trials into what they say of all controllers.
        limits: Objectives that count as 0 and 1.
    """

    candidates: Candidates
    fit: Fit
    limits: tuple[float, float]

    def after(self, history: History) -> tuple[Posterior, float]:
        """What at least one trial says of all controllers, and the largest objective in its units."""
        f = scale_objectives(torch.tensor(history.f), self.limits)
        with torch.no_grad():
            phi = self.candidates.features_of(torch.tensor(history.x))
        return self.fit(phi, f), float(f.max())


def on_controllers(kernel: KernelOf, problem: Problem) -> Surrogate:
    """k_0 on x, with a lengthscale for every controller parameter.

    Args:
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share.

    Returns:
        The surrogate; objectives are scaled to the problem's limits.
    """
    return _kernel_surrogate(as_they_are(problem), partial(kernel, problem.dimensions), problem)


def on_paths(kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""k_0 on \bar\tau, with a lengthscale for every latent dimension.

    Args:
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with latents.

    Returns:
        The surrogate.
    """
    return _on_latents(svae, kernel, problem)


def on_compressed_paths(kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""k_0 on (1 - \bar y) \bar\tau, equation (k_svae_dc).

    Args:
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with the latents of an SVAE-DC.

    Returns:
        The surrogate.
    """
    problem.known_badness()
    return _on_latents(svae_dc, kernel, problem)


def on_sigmoid_paths(kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""k_0 on sigmoid(\alpha((1 - \bar y) - c)) \bar\tau.

    Args:
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with the latents of an SVAE-DC.

    Returns:
        The surrogate.
    """
    problem.known_badness()
    return _on_latents(Sigmoid(), kernel, problem)


def on_whitened_paths(kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""k_0 on (1 - \bar y) \bar\tau / s.

    Args:
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with the latents of an SVAE-DC for at least two controllers.

    Returns:
        The surrogate; s is the spread over the pool.
    """
    return _on_latents(Whitened.over(problem.known_badness().tau), kernel, problem)


def on_screened_paths(kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""k_0 on \bar\tau, among the controllers predicted least bad.

    Args:
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with the latents of an SVAE-DC.

    Returns:
        The surrogate over this share of the pool (`LEAST_BAD`).
    """
    return on_paths(kernel, problem.least_bad(LEAST_BAD))


def on_adjusted_paths(kernel: KernelOf, problem: Problem) -> Surrogate:
    r"""k_0 on sigmoid(\alpha((1 - \bar y) - c)) \bar\tau, fitted with alpha, c and the last layers.

    Args:
        kernel: k_0, made from its number of lengthscales.
        problem: What the methods of a run share, with the latents of an SVAE-DC and its adjustable layers.

    Returns:
        The surrogate; its candidates are compared in the unit cube, because phi is part of the kernel.
    """
    problem.known_badness()
    start, adjustable = Sigmoid(), problem.known_adjustable()
    trained = by_latents(problem, start)

    def adjusted() -> Kernel:
        return kernels.Embedded(kernel(trained.phi.shape[1]), AdjustedPaths(adjustable, trained.unit, start))

    return _kernel_surrogate(in_the_cube(problem), adjusted, problem)


def on_trajectories(problem: Problem) -> Surrogate:
    """BBK-KL: the symmetrised KL between p(xi|x_i) and p(xi|x_j)."""
    return _on_density(problem.known_densities().xi, problem)


def on_latent_distributions(problem: Problem) -> Surrogate:
    """LKL: the symmetrised KL between p(tau|x_i) and p(tau|x_j)."""
    return _on_density(problem.known_densities().tau, problem)


def packaged_gp(fit: Fit, problem: Problem) -> Surrogate:
    """A process of others on x, in the objective's own units, as they expect them.

    Args:
        fit: Fits a process to controllers and objectives.
        problem: What the methods of a run share; its objective limits are not used.

    Returns:
        The surrogate.
    """
    return Surrogate(in_the_cube(problem), fit, _AS_MEASURED)


def _on_latents(
    embedding: Callable[[Tensor, Tensor], Tensor], kernel: KernelOf, problem: Problem
) -> Surrogate:
    candidates = by_latents(problem, embedding)
    return _kernel_surrogate(candidates, partial(kernel, candidates.phi.shape[1]), problem)


def _on_density(density: Density, problem: Problem) -> Surrogate:
    candidates = by_density(problem, density)
    some = candidates.phi[:_FOR_MEDIAN]
    median = float(kernels.distance(density.divergence, some, some).median()) if len(some) else 1.0
    return _kernel_surrogate(candidates, partial(kernels.kl, density.divergence, median or 1.0), problem)


def _kernel_surrogate(candidates: Candidates, kernel: Callable[[], Kernel], problem: Problem) -> Surrogate:
    return Surrogate(candidates, partial(fit, kernel), problem.objective_limits)
