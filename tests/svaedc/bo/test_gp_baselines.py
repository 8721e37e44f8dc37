import pytest
import torch
from botorch.fit import fit_gpytorch_mll
from botorch.models import SingleTaskGP
from gpytorch.mlls import ExactMarginalLogLikelihood

from svaedc.bo import gp


def trials(count=8):
    x = torch.rand(count, 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    return x, 10 + 5 * torch.sin(4 * x[:, 0]) - x[:, 1]


def test_default_process_is_botorchs_own_in_the_units_of_the_objective():
    x, f = trials()
    model = SingleTaskGP(x, f[:, None])
    fit_gpytorch_mll(ExactMarginalLogLikelihood(model.likelihood, model))
    pool = torch.rand(9, 3, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    with torch.no_grad():
        theirs = model.posterior(pool[:, None])
    mu, sigma = gp.default(x, f).moments(pool)
    torch.testing.assert_close(mu, theirs.mean.flatten(), rtol=1e-4, atol=1e-4)
    torch.testing.assert_close(sigma, theirs.variance.sqrt().flatten(), rtol=1e-4, atol=1e-4)


def test_process_of_turbo_keeps_to_its_ranges():
    model = gp.turbo(*trials()).model
    lengthscale = model.covar_module.base_kernel.lengthscale
    assert lengthscale.shape == (1, 3)
    assert ((lengthscale > 0.005) & (lengthscale < 4 + 1e-6)).all()
    assert 1e-8 < model.likelihood.noise.item() < 1e-3


@pytest.mark.parametrize(
    ("surrogate", "count"),
    [
        *((gp.default, count) for count in (1, 2, 8)),
        *((gp.turbo, count) for count in (2, 8)),
        pytest.param(gp.saas, 2, marks=pytest.mark.slow),
        pytest.param(gp.saas, 8, marks=pytest.mark.slow),
    ],
)
def test_baseline_believes_its_measurements_and_doubts_what_is_far(surrogate, count):
    x, f = trials(count)
    process = surrogate(x, f)
    mu, sigma = process.moments(x)
    spread = f.std().item() if count > 1 else 1.0
    assert process.event == ""
    assert ((mu - f).abs() < 0.7 * spread + 1e-6).all()
    assert process.moments(x + 3)[1].min() > sigma.max()
