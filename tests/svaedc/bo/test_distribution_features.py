import numpy as np
import pytest
import torch

from svaedc.bo import distribution_features
from svaedc.bo.distribution_features import Densities


@pytest.fixture
def frozen(model):
    return model.eval().requires_grad_(requires_grad=False)


@pytest.fixture
def x(episodes):
    return torch.tensor(episodes.x[:7])


def test_latent_rows_are_the_models_own_distribution(frozen, x):
    q = frozen.prior(x)
    loc, log_scale = distribution_features.latent_rows(frozen, x).chunk(2, dim=1)
    k = frozen.config.tau_size
    torch.testing.assert_close(loc, q.loc[:, :k].double())
    torch.testing.assert_close(log_scale, q.scale[:, :k].log().double())


@pytest.mark.parametrize("dimensions", [1, 3, 9, 16, 30])
def test_the_latent_paths_behind_the_moments_have_mean_0_and_covariance_1(dimensions):
    corners = distribution_features._corners(dimensions).double()
    assert corners.mean(dim=0).tolist() == [0.0] * dimensions
    torch.testing.assert_close(corners.T.cov(correction=0), torch.eye(dimensions).double().squeeze())


def test_trajectory_rows_are_the_moments_of_trajectories_drawn_from_the_model(frozen, x):
    mean, log_deviation = distribution_features.trajectory_rows(frozen, x[:2]).chunk(2, dim=1)
    torch.manual_seed(0)
    q = frozen.prior(x[:2].repeat(4_000, 1))
    drawn = frozen.p_xi(frozen.split(q.rsample())[0]).rsample()
    steps = torch.linspace(0, drawn.shape[2] - 1, distribution_features.STEPS).round().long()
    drawn = drawn[:, :, steps].flatten(1).unflatten(0, (-1, 2)).double()
    deviation = drawn.std(dim=0)
    assert ((mean - drawn.mean(dim=0)).abs() < 0.15 * deviation).all()
    torch.testing.assert_close(log_deviation.exp(), deviation, rtol=0.15, atol=0)


def test_rows_are_the_same_every_time_and_for_every_block(frozen, x, monkeypatch):
    whole = distribution_features.trajectory_rows(frozen, x)
    torch.manual_seed(5)
    torch.testing.assert_close(distribution_features.trajectory_rows(frozen, x), whole, rtol=0, atol=0)
    monkeypatch.setattr(distribution_features, "BLOCK", 2)
    torch.testing.assert_close(distribution_features.trajectory_rows(frozen, x), whole)


def test_gradients_reach_the_controller(frozen, x):
    for density in (Densities.of(frozen).tau, Densities.of(frozen).xi):
        at = x[:2].double().requires_grad_()
        density.rows(at).sum().backward()
        assert at.grad.abs().max() > 0


def test_divergence_of_latent_paths_is_that_of_the_models_family(frozen):
    assert Densities.of(frozen).tau.divergence is distribution_features.laplace
    assert Densities.of(frozen).xi.divergence is distribution_features.gaussian


def test_controller_is_nearest_to_itself(frozen, x):
    for density in (Densities.of(frozen).tau, Densities.of(frozen).xi):
        matrix = density.divergence(density.rows(x), density.rows(x))
        np.testing.assert_array_equal(matrix.argmin(dim=1), range(len(x)))
