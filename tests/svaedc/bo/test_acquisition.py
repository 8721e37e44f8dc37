import math

import mpmath
import pytest
import torch
from botorch.acquisition.analytic import LogExpectedImprovement, UpperConfidenceBound

from svaedc.bo import gp, kernels
from svaedc.bo.acquisition import log_ei, ucb


def tensor(*values):
    return torch.tensor(values, dtype=torch.float64)


def fitted():
    phi = torch.rand(8, 2, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    return gp.fit(lambda: kernels.se(2), phi, phi.sum(dim=1) / 2)


@pytest.mark.parametrize(
    ("ours", "theirs"),
    [
        (ucb, lambda model: UpperConfidenceBound(model, beta=1.0)),
        (log_ei, lambda model: LogExpectedImprovement(model, best_f=0.6)),
    ],
)
def test_acquisition_is_that_of_botorch(ours, theirs):
    process = fitted()
    pool = torch.rand(40, 2, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    with torch.no_grad():
        expected = theirs(process.model)(pool[:, None])
        torch.testing.assert_close(ours(*process.moments(pool), 0.6), expected, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("z", [3.0, 0.0, -0.999, -1.001, -30.0, -999.0, -1001.0, -1e5])
def test_log_expected_improvement_is_exact_however_hopeless(z):
    with mpmath.workdps(60):
        exact = mpmath.log(mpmath.npdf(z) + z * mpmath.ncdf(z)) + mpmath.log(0.5)
    ours = log_ei(tensor(1.0 + 0.5 * z), tensor(0.5), 1.0)
    assert ours.item() == pytest.approx(float(exact), rel=1e-9)


@pytest.mark.parametrize("z", [2.0, -0.5, -2.0, -50.0, -2e3])
def test_gradients_of_log_expected_improvement_are_those_of_finite_differences(z):
    mu, sigma = tensor(z).requires_grad_(), tensor(1.0).requires_grad_()
    assert torch.autograd.gradcheck(lambda mu, sigma: log_ei(mu, sigma, 0.0), (mu, sigma), rtol=1e-4)


def test_ucb_adds_one_standard_deviation():
    assert ucb(tensor(0.3), tensor(0.2), math.nan).item() == pytest.approx(0.5)
