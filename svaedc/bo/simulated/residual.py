r"""A Gaussian process on what the simulated objective leaves, in which nothing is fitted.

    f(x) = \bar f(x) - `CAUTION` s(x) + b + g(x)

\bar f is the mean objective over the simulated worlds and s its spread; b ~ N(0, `SHIFT`^2); g has the kernel
`SCALE`^2 k_0 with one short lengthscale, `LENGTHSCALE`, so that a trial speaks of candidates that do nearly
the same, and of no others. The noise is that of what features do not tell. All five numbers were chosen on
tuning seeds (docs/results/tuning.md): hyper-parameters that are fitted to a handful of trials, and trust that
is, made ten trials worse.
"""

from functools import partial
from typing import Final

import torch
from gpytorch.kernels import ConstantKernel, Kernel, RBFKernel, ScaleKernel

from svaedc.bo.candidates import Problem, by_latents
from svaedc.bo.features import Embedding, svae, svae_dc
from svaedc.bo.gp import condition
from svaedc.bo.kernels import Embedded
from svaedc.bo.simulated.prior import SimulatedMean, with_simulations, worlds_behind
from svaedc.bo.surrogates import Surrogate

CAUTION: Final = 0.5
SHIFT: Final = 0.1
SCALE: Final = 0.6
NOISE: Final = 0.15
"""These are in parts of the range of objectives."""
LENGTHSCALE: Final = 0.3
"""It is in parts of the root-mean-square distance between candidates."""


def on_paths(problem: Problem) -> Surrogate:
    r"""What simulation leaves, by the distance of \bar\tau.

    Args:
        problem: What the methods of a run share, with simulated outcomes and latents.

    Returns:
        The surrogate.
    """
    return _on_latents(svae, problem)


def on_compressed_paths(problem: Problem) -> Surrogate:
    r"""What simulation leaves, by the distance of (1 - \bar y) \bar\tau.

    Args:
        problem: What the methods of a run share, with simulated outcomes and the latents of an SVAE-DC.

    Returns:
        The surrogate.
    """
    problem.known_badness()
    return _on_latents(svae_dc, problem)


def _on_latents(embedding: Embedding, problem: Problem) -> Surrogate:
    problem.known_outcomes()
    compared = by_latents(problem, embedding)
    features, worlds = worlds_behind(compared.phi.shape[1])
    process = partial(
        condition,
        lambda: Embedded(_nearby(), features) + _shift(),
        mean=lambda: SimulatedMean(worlds, CAUTION),
        noise=NOISE**2,
    )
    return Surrogate(with_simulations(compared, problem), process, problem.objective_limits)


def _nearby() -> Kernel:
    kernel = ScaleKernel(RBFKernel())
    kernel.outputscale, kernel.base_kernel.lengthscale = SCALE**2, LENGTHSCALE
    return kernel


def _shift() -> Kernel:
    kernel = ConstantKernel()
    kernel.constant = torch.tensor(SHIFT**2)
    return kernel
