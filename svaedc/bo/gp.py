"""What is expected of controllers that were not tried: a Gaussian process fitted to the history."""

import logging
import warnings
from collections.abc import Callable
from typing import Protocol, runtime_checkable

import numpy as np
import torch
from botorch.exceptions.errors import ModelFittingError
from botorch.exceptions.warnings import OptimizationWarning
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from botorch.models.map_saas import AdditiveMapSaasSingleTaskGP
from botorch.models.transforms.outcome import Standardize
from botorch.optim.fit import fit_gpytorch_mll_scipy
from botorch.settings import validate_input_scaling
from gpytorch.constraints import GreaterThan, Interval
from gpytorch.kernels import Kernel, MaternKernel, ScaleKernel
from gpytorch.likelihoods import GaussianLikelihood
from gpytorch.means import ConstantMean, Mean
from gpytorch.mlls import ExactMarginalLogLikelihood
from jaxtyping import Float
from linear_operator.utils.cholesky import psd_safe_cholesky
from linear_operator.utils.errors import NanError, NotPSDError
from torch import Tensor

LEAST_NOISE = 1e-4
"""This is the smallest variance with which no Cholesky factorisation failed in float64."""
FIT_ITERATIONS = 25
"""L-BFGS stops after so many; with 22 trials in 48 dimensions the choice no longer changes after 15."""
_LEAST_VARIANCE = 1e-12
_NOTHING, _ONE = torch.tensor(0.0), torch.tensor(1.0)

_log = logging.getLogger(__name__)


@runtime_checkable
class Posterior(Protocol):
    """What the trials say of f at any controller: mean and standard deviation."""

    def moments(self, phi: Float[Tensor, "*batch n k"]) -> tuple[Tensor, Tensor]:
        """Mean and standard deviation [*batch, n] of f at each of these features; gradients reach them."""
        ...


Fit = Callable[[Tensor, Tensor], Posterior]
"""It turns features [n, k] and objectives [n] of the trials into what is expected elsewhere."""


class GaussianProcess:
    r"""A fitted process: \mu = m + k^T K^{-1} (f - m), \sigma^2 = k_0 - k^T K^{-1} k, K with its noise.

    Each controller on its own, where BoTorch's posterior would predict them jointly, ten times slower.

    Attributes:
        model: Its mean, kernel, noise and trials.
        event: Empty, or what went wrong while fitting and which hyper-parameters stand in.
    """

    def __init__(
        self, model: SingleTaskGP, event: str = "", offset: Tensor = _NOTHING, factor: Tensor = _ONE
    ) -> None:
        """Conditions a model on its trials; the units of f are offset + factor times those of the model."""
        self.model = model.eval().requires_grad_(requires_grad=False)
        self.event = event
        self._offset, self._unit = offset, factor
        (self._trials,) = model.train_inputs
        matrix = model.covar_module(self._trials).to_dense()
        self._factor = psd_safe_cholesky(matrix + model.likelihood.noise * torch.eye(len(matrix)).to(matrix))
        residual = (model.train_targets - model.mean_module(self._trials)).unsqueeze(-1)
        self._weights = torch.cholesky_solve(residual, self._factor)

    def moments(self, phi: Float[Tensor, "*batch n k"]) -> tuple[Tensor, Tensor]:
        """Mean and standard deviation [*batch, n] of f at each of these features; gradients reach them."""
        k = self.model.covar_module(phi, self._trials).to_dense()
        k_0 = self.model.covar_module(phi, diag=True)
        mu = self.model.mean_module(phi) + (k @ self._weights).squeeze(-1)
        explained = torch.linalg.solve_triangular(self._factor, k.mT, upper=False).square().sum(dim=-2)
        sigma = (k_0 - explained).clamp_min(_LEAST_VARIANCE).sqrt()
        return self._offset + self._unit * mu, self._unit * sigma


def scale_objectives(f: Float[Tensor, "*n"], limits: tuple[float, float]) -> Float[Tensor, "*n"]:
    """Put the setup's limits at 0 and 1.

    The limits are fixed per setup. Standardising by the few values of a run would make its first step depend
    on the luck of two random trials.

    Args:
        f: Objectives, [*n].
        limits: Objectives that become 0 and 1.

    Returns:
        Scaled objectives, [*n]; outside [0, 1] where an objective is beyond the limits.
    """
    low, high = limits
    return (f - low) / (high - low)


def constant_mean() -> Mean:
    """m, between the limits of f; it is fitted."""
    return ConstantMean(constant_constraint=Interval(0.0, 1.0, initial_value=0.5))


def fit(
    kernel: Callable[[], Kernel],
    phi: Float[Tensor, "n k"],
    f: Float[Tensor, " n"],
    mean: Callable[[], Mean] = constant_mean,
) -> GaussianProcess:
    """Hyper-parameters of maximum marginal likelihood, and the process with them conditioned on all trials.

    Where a fit fails, the last good hyper-parameters serve: those fitted to the longest beginning of the
    history for which it succeeds, so that the outcome depends on the history alone; with none, those the
    kernel starts from.

    Args:
        kernel: Makes the kernel, with its starting hyper-parameters.
        phi: Features of the trials, float64, of root-mean-square distance near 1.
        f: Objectives, scaled to [0, 1].
        mean: Makes the mean.

    Returns:
        The process, conditioned on all trials; its `event` says what went wrong, if anything did.
    """
    process = _process(kernel(), mean(), phi, f)
    event = ""
    for count in range(len(f), 0, -1):
        fitted = _process(kernel(), mean(), phi[:count], f[:count])
        try:
            _maximize_likelihood(fitted)
        except (NanError, NotPSDError, ModelFittingError) as error:
            event = event or f"hyper-parameters not fitted to {count} trials, earlier ones serve: {error}"
            continue
        process.load_state_dict(fitted.state_dict())
        break
    if event:
        _log.warning(event)
    return GaussianProcess(process, event)


def condition(
    kernel: Callable[[], Kernel],
    phi: Float[Tensor, "n k"],
    f: Float[Tensor, " n"],
    mean: Callable[[], Mean],
    noise: float,
) -> GaussianProcess:
    """The process with hyper-parameters that are given, conditioned on all trials.

    Args:
        kernel: Makes the kernel.
        phi: Features of the trials, float64.
        f: Objectives, scaled to [0, 1].
        mean: Makes the mean.
        noise: Its variance.

    Returns:
        The process.
    """
    process = _process(kernel(), mean(), phi, f)
    process.likelihood.noise = noise
    return GaussianProcess(process)


def _process(kernel: Kernel, mean: Mean, phi: Tensor, f: Tensor) -> SingleTaskGP:
    likelihood = GaussianLikelihood(noise_constraint=GreaterThan(LEAST_NOISE, initial_value=1e-3))
    # BoTorch warns that features are outside the unit cube and objectives not standardised: both are meant.
    with validate_input_scaling(state=False):
        return SingleTaskGP(
            phi,
            f[:, None],
            likelihood=likelihood,
            covar_module=kernel,
            mean_module=mean,
            outcome_transform=None,
        )


def _maximize_likelihood(model: SingleTaskGP) -> None:
    likelihood = ExactMarginalLogLikelihood(model.likelihood, model).train()
    with warnings.catch_warnings():
        # Reaching FIT_ITERATIONS is no failure: the likelihood of a few trials is flat long before.
        warnings.simplefilter("ignore", OptimizationWarning)
        result = fit_gpytorch_mll_scipy(likelihood, options={"maxiter": FIT_ITERATIONS})
    if result.fval is None or not np.isfinite(result.fval):
        raise ModelFittingError(f"the marginal likelihood is {result.fval}")


def default(x: Float[Tensor, "n D"], f: Float[Tensor, " n"]) -> GaussianProcess:
    """BoTorch's default process: SE with dimension-scaled priors (Hvarfner et al., ICML 2024).

    Args:
        x: Controllers of the trials, [n, D].
        f: Their objectives in any unit, [n].

    Returns:
        The fitted process, in the unit of `f`.
    """
    return _fit(SingleTaskGP, x, f)


def saas(x: Float[Tensor, "n D"], f: Float[Tensor, " n"]) -> GaussianProcess:
    """A sum of Matern kernels under sparsity priors (Eriksson and Jankowiak, UAI 2021).

    BoTorch's maximum-a-posteriori form: its Markov chain Monte Carlo takes minutes for each trial.

    Args:
        x: Controllers of the trials, [n, D].
        f: Their objectives in any unit, [n].

    Returns:
        The fitted process, in the unit of `f`.
    """
    return _fit(AdditiveMapSaasSingleTaskGP, x, f)


def turbo(x: Float[Tensor, "n D"], f: Float[Tensor, " n"]) -> GaussianProcess:
    """The process of TuRBO's reference code: Matern-5/2 with bounded lengthscales and little noise.

    Args:
        x: Controllers of the trials, [n, D].
        f: Their objectives in any unit, [n].

    Returns:
        The fitted process, in the unit of `f`.
    """
    return _fit(_matern_of_turbo, x, f)


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


def _fit(build: Callable[..., SingleTaskGP], x: Tensor, f: Tensor) -> GaussianProcess:
    standardized = Standardize(m=1)
    model, event = build(x, f[:, None], outcome_transform=standardized), ""
    try:
        with warnings.catch_warnings():
            # Of a fit that found no better hyper-parameters, as for equal outcomes.
            warnings.simplefilter("ignore", OptimizationWarning)
            fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    except ModelFittingError as error:
        event = f"hyper-parameters keep their starting values: {error}"
        _log.warning(event)
    return GaussianProcess(model, event, standardized.means.squeeze(), standardized.stdvs.squeeze())
