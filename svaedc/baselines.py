"""What a practitioner would take today: surrogates of others, with the settings they come with."""

import logging
import warnings
from collections.abc import Callable

from botorch.exceptions.errors import ModelFittingError
from botorch.exceptions.warnings import OptimizationWarning
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from botorch.models.map_saas import AdditiveMapSaasSingleTaskGP
from botorch.models.transforms.outcome import Standardize
from gpytorch.constraints import Interval
from gpytorch.kernels import MaternKernel, ScaleKernel
from gpytorch.likelihoods import GaussianLikelihood
from gpytorch.mlls import ExactMarginalLogLikelihood
from jaxtyping import Float
from torch import Tensor

from svaedc.surrogates import Process

_log = logging.getLogger(__name__)


def default(x: Float[Tensor, "n D"], f: Float[Tensor, " n"]) -> Process:
    """BoTorch's default process: SE with dimension-scaled priors (Hvarfner et al., ICML 2024)."""
    return _fitted(SingleTaskGP, x, f)


def saas(x: Float[Tensor, "n D"], f: Float[Tensor, " n"]) -> Process:
    """A sum of Matern kernels under sparsity priors (Eriksson and Jankowiak, UAI 2021).

    BoTorch's maximum-a-posteriori form: its Markov chain Monte Carlo takes minutes for each trial.
    """
    return _fitted(AdditiveMapSaasSingleTaskGP, x, f)


def turbo(x: Float[Tensor, "n D"], f: Float[Tensor, " n"]) -> Process:
    """The process of TuRBO's reference code: Matern-5/2 with bounded lengthscales and little noise."""
    return _fitted(_matern_of_turbo, x, f)


def _matern_of_turbo(x: Tensor, f: Tensor, outcome_transform: Standardize) -> SingleTaskGP:
    lengthscale = Interval(0.005, 4.0)
    kernel = MaternKernel(nu=2.5, ard_num_dims=x.shape[1], lengthscale_constraint=lengthscale)
    return SingleTaskGP(
        x,
        f,
        likelihood=GaussianLikelihood(noise_constraint=Interval(1e-8, 1e-3)),
        covar_module=ScaleKernel(kernel),
        outcome_transform=outcome_transform,
    )


def _fitted(build: Callable[..., SingleTaskGP], x: Tensor, f: Tensor) -> Process:
    standardised = Standardize(m=1)
    model, event = build(x, f[:, None], outcome_transform=standardised), ""
    try:
        with warnings.catch_warnings():
            # Of a fit that found no better hyper-parameters, as for equal outcomes.
            warnings.simplefilter("ignore", OptimizationWarning)
            fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    except ModelFittingError as error:
        event = f"hyper-parameters keep their starting values: {error}"
        _log.warning(event)
    return Process(model, event, standardised.means.squeeze(), standardised.stdvs.squeeze())
