"""One step of Bayesian optimisation: a Gaussian process fitted to the history, and what to try next."""

import logging
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
import torch
from botorch.acquisition.analytic import LogExpectedImprovement
from botorch.exceptions.errors import ModelFittingError
from botorch.exceptions.warnings import OptimizationWarning
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from botorch.optim.fit import fit_gpytorch_mll_scipy
from botorch.optim.optimize import optimize_acqf
from botorch.settings import validate_input_scaling
from gpytorch.constraints import GreaterThan, Interval
from gpytorch.kernels import Kernel
from gpytorch.likelihoods import GaussianLikelihood
from gpytorch.means import ConstantMean
from gpytorch.mlls import ExactMarginalLogLikelihood
from jaxtyping import Float
from linear_operator.utils.errors import NanError, NotPSDError
from torch import Tensor
from torch.nn.functional import pad

BETA = 1.0
"""Weight of the variance in UCB (section 6 of the paper)."""
LEAST_NOISE = 1e-4
"""Variance; the smallest with which no Cholesky factorisation failed in float64."""
FIT_ITERATIONS = 25
"""Of L-BFGS; with 22 trials in 48 dimensions the chosen controller no longer changes after 15."""
BLOCK = 50
"""Candidates predicted jointly."""
RESTARTS, RAW_SAMPLES = 5, 256

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Surrogate:
    """A Gaussian process ready to predict.

    Attributes:
        model: The process, in evaluation mode.
        event: Empty, or what went wrong while fitting and which hyper-parameters stand in.
    """

    model: SingleTaskGP
    event: str = ""


def scaled(f: Float[Tensor, " n"], limits: tuple[float, float]) -> Float[Tensor, " n"]:
    """Objectives with the setup's limits at 0 and 1.

    The limits are fixed per setup. Standardising by the few values of a run would make its first step depend
    on the luck of two random trials.
    """
    low, high = limits
    return (f - low) / (high - low)


def fit(kernel: Callable[[], Kernel], phi: Float[Tensor, "n k"], f: Float[Tensor, " n"]) -> Surrogate:
    """Hyper-parameters of maximum marginal likelihood, and the process with them conditioned on all trials.

    Where a fit fails, the last good hyper-parameters serve: those fitted to the longest beginning of the
    history for which it succeeds, so that the outcome depends on the history alone; with none, those the
    kernel starts from.

    Args:
        kernel: Makes the kernel, with its starting hyper-parameters.
        phi: Features of the trials, float64, of root-mean-square distance near 1.
        f: Objectives, scaled to [0, 1].
    """
    process = _process(kernel(), phi, f)
    event = ""
    for count in range(len(f), 0, -1):
        fitted = _process(kernel(), phi[:count], f[:count])
        try:
            _maximise_likelihood(fitted)
        except (NanError, NotPSDError, ModelFittingError) as error:
            event = event or f"hyper-parameters not fitted to {count} trials, earlier ones serve: {error}"
            continue
        process.load_state_dict(fitted.state_dict())
        break
    if event:
        _log.warning(event)
    return Surrogate(process.eval(), event)


def ucb(model: SingleTaskGP, phi: Float[Tensor, "n k"]) -> Float[Tensor, " n"]:
    r"""UCB(x) = \mu(x) + \sqrt\beta \sigma(x) with beta = 1, the root as in BoTorch."""
    # BoTorch's own class predicts every candidate as a batch of one: the same numbers, ten times slower.
    blocks = pad(phi, (0, 0, 0, -len(phi) % BLOCK)).reshape(-1, BLOCK, phi.shape[1])
    with torch.no_grad():
        posterior = model.posterior(blocks)
        mu, sigma = posterior.mean.flatten(), posterior.variance.sqrt().flatten()
    return (mu + BETA**0.5 * sigma)[: len(phi)]


def maximise_log_ei(x: Float[Tensor, "n D"], f: Float[Tensor, " n"]) -> Float[Tensor, " D"]:
    """The maximum in the unit cube of log expected improvement under BoTorch's default process.

    What a practitioner writes today, untouched: dimension-scaled priors, standardised objective, multi-start
    gradient search.
    """
    model = SingleTaskGP(x, f[:, None])
    try:
        fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    except ModelFittingError as error:
        _log.warning("hyper-parameters keep their prior modes: %s", error)
    bounds = torch.stack([torch.zeros(x.shape[1]), torch.ones(x.shape[1])]).to(x)
    best, _ = optimize_acqf(
        LogExpectedImprovement(model.eval(), best_f=f.max()),
        bounds,
        q=1,
        num_restarts=RESTARTS,
        raw_samples=RAW_SAMPLES,
    )
    return best[0].detach()


@contextmanager
def torch_randomness(rng: np.random.Generator) -> Iterator[None]:
    """Inside, torch draws from `rng`; afterwards, its global state is what it was."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(int(rng.integers(2**63)))
        yield


def _process(kernel: Kernel, phi: Tensor, f: Tensor) -> SingleTaskGP:
    mean = ConstantMean(constant_constraint=Interval(0.0, 1.0, initial_value=0.5))
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


def _maximise_likelihood(model: SingleTaskGP) -> None:
    likelihood = ExactMarginalLogLikelihood(model.likelihood, model).train()
    with warnings.catch_warnings():
        # Reaching FIT_ITERATIONS is no failure: the likelihood of a few trials is flat long before.
        warnings.simplefilter("ignore", OptimizationWarning)
        result = fit_gpytorch_mll_scipy(likelihood, options={"maxiter": FIT_ITERATIONS})
    if result.fval is None or not np.isfinite(result.fval):
        raise ModelFittingError(f"the marginal likelihood is {result.fval}")
