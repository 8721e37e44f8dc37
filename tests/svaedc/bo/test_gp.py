import math

import numpy as np
import pytest
import torch
from gpytorch.kernels import RBFKernel
from linear_operator.utils.errors import NotPSDError

from svaedc.bo import gp, kernels


def trials(count, dimensions=3, seed=0):
    generator = torch.Generator().manual_seed(seed)
    phi = torch.rand(count, dimensions, generator=generator, dtype=torch.float64)
    return phi, (1 - (phi - 0.4).square().sum(dim=1)).clamp(0, 1)


def isotropic():
    return kernels.se(1)


def hyper_parameters(model):
    return {name: value.detach().clone() for name, value in model.named_parameters()}


def test_prediction_is_the_closed_form_of_a_gaussian_process():
    phi, f = trials(9)
    candidates, _ = trials(7, seed=1)
    process = gp.fit(isotropic, phi, f)
    model = process.model
    ell, sigma2 = model.covar_module.base_kernel.lengthscale.item(), model.covar_module.outputscale.item()
    noise, mean = model.likelihood.noise.item(), model.mean_module.constant.item()

    def k(a, b):
        return sigma2 * np.exp(-0.5 * ((a[:, None] - b[None]) ** 2).sum(-1) / ell**2)

    x, z = phi.numpy(), candidates.numpy()
    inverse = np.linalg.inv(k(x, x) + noise * np.eye(len(x)))
    mu = mean + k(z, x) @ inverse @ (f.numpy() - mean)
    sigma = np.sqrt(np.diag(k(z, z) - k(z, x) @ inverse @ k(x, z)))
    for ours, theirs in zip(process.moments(candidates), (mu, sigma), strict=True):
        np.testing.assert_allclose(ours.numpy(), theirs, rtol=1e-6)


def test_moments_are_those_of_botorch_whatever_the_batch():
    phi, f = trials(12)
    pool, _ = trials(24, seed=1)
    process = gp.fit(lambda: kernels.matern(3), phi, f)
    with torch.no_grad():
        theirs = process.model.posterior(pool[:, None])
    for shape in ((24,), (24, 1), (2, 3, 4)):
        mu, sigma = process.moments(pool.reshape(*shape, 3))
        torch.testing.assert_close(mu.flatten(), theirs.mean.flatten())
        torch.testing.assert_close(sigma.flatten(), theirs.variance.sqrt().flatten())


def test_gradients_reach_the_features_and_leave_the_hyper_parameters_alone():
    process = gp.fit(isotropic, *trials(6))
    phi = trials(2, seed=1)[0].requires_grad_()
    assert torch.autograd.gradcheck(process.moments, phi)
    assert not any(parameter.requires_grad for parameter in process.model.parameters())


@pytest.mark.parametrize("kernel", [isotropic, lambda: kernels.se(3), lambda: kernels.matern(3)])
@pytest.mark.parametrize("count", [1, 2, 22])
def test_fitted_hyper_parameters_stay_within_their_ranges(kernel, count):
    surrogate = gp.fit(kernel, *trials(count))
    covariance = surrogate.model.covar_module

    def within(values, low, high):
        # GPyTorch keeps the ends of a range in float32.
        return bool(((values >= low * (1 - 1e-6)) & (values <= high * (1 + 1e-6))).all())

    assert surrogate.event == ""
    assert within(covariance.base_kernel.lengthscale, *kernels.LENGTHSCALE)
    assert within(covariance.outputscale, *kernels.OUTPUT_SCALE)
    assert within(surrogate.model.likelihood.noise, gp.LEAST_NOISE, math.inf)
    assert within(surrogate.model.mean_module.constant, 0, 1)


def test_fit_raises_the_marginal_likelihood_of_the_starting_point():
    phi, f = trials(15)

    def log_likelihood(model):
        model.train()
        predicted = model.likelihood(model(phi))
        return predicted.log_prob(f).item()

    def unfitted():
        kernel = isotropic()
        kernel.requires_grad_(False)
        return kernel

    assert (
        log_likelihood(gp.fit(isotropic, phi, f).model) > log_likelihood(gp.fit(unfitted, phi, f).model) + 0.1
    )


def test_dimension_without_influence_gets_the_longer_lengthscale():
    generator = torch.Generator().manual_seed(3)
    phi = torch.rand(25, 2, generator=generator, dtype=torch.float64)
    model = gp.fit(lambda: kernels.se(2), phi, 0.5 + 0.4 * torch.sin(8 * phi[:, 0])).model
    relevant, irrelevant = model.covar_module.base_kernel.lengthscale.flatten().tolist()
    assert irrelevant > 3 * relevant


def test_repeated_controllers_with_different_outcomes_do_not_break_the_fit():
    phi, f = torch.full((20, 3), 0.5).double(), torch.linspace(0, 1, 20).double()
    surrogate = gp.fit(isotropic, phi, f)
    assert surrogate.event == ""
    assert torch.isfinite(torch.stack(surrogate.moments(phi))).all()


class FailsInFitsOfMoreThan(RBFKernel):
    """A kernel that cannot be trained on more than so many trials, but predicts."""

    def __init__(self, trials):
        super().__init__()
        self.trials = trials

    def forward(self, x1, x2, **params):
        if self.training and len(x1) > self.trials:
            raise NotPSDError("not positive definite")
        return super().forward(x1, x2, **params)


def test_failed_fit_keeps_the_last_good_hyper_parameters_and_says_so(caplog):
    phi, f = trials(8)
    surrogate = gp.fit(lambda: FailsInFitsOfMoreThan(5), phi, f)
    last_good = gp.fit(lambda: FailsInFitsOfMoreThan(5), phi[:5], f[:5])
    assert last_good.event == ""
    for name, value in hyper_parameters(last_good.model).items():
        torch.testing.assert_close(hyper_parameters(surrogate.model)[name], value)
    assert "not fitted to 8 trials" in surrogate.event
    assert "not fitted to 8 trials" in caplog.text


def test_surrogate_with_borrowed_hyper_parameters_still_knows_every_trial():
    phi, f = trials(8)
    model = gp.fit(lambda: FailsInFitsOfMoreThan(5), phi, f).model
    torch.testing.assert_close(model.train_inputs[0], phi)
    torch.testing.assert_close(model.train_targets, f)


def test_fit_that_never_succeeds_predicts_with_the_starting_hyper_parameters():
    phi, f = trials(3)
    surrogate = gp.fit(lambda: FailsInFitsOfMoreThan(0), phi, f)
    assert surrogate.event
    assert surrogate.model.covar_module.lengthscale.item() == pytest.approx(math.log(2))
    assert torch.isfinite(torch.stack(surrogate.moments(phi))).all()


def test_scaling_puts_the_limits_at_zero_and_one():
    f = torch.tensor([-2.0, 0.0, 2.0, 4.0], dtype=torch.float64)
    assert gp.scale_objectives(f, (-2.0, 2.0)).tolist() == [0.0, 0.5, 1.0, 1.5]
