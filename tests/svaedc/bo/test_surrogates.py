"""What each method compares, and in which units."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.bo import kernels
from svaedc.bo.history import History
from svaedc.bo.methods import LATENT_SURROGATES, SURROGATES
from svaedc.bo.surrogates import (
    LEAST_BAD,
    on_compressed_paths,
    on_controllers,
    on_paths,
    on_screened_paths,
)
from tests.svaedc.bo.fake_latents import TAU_DIMENSIONS, latent_means, problem

PROBLEM = problem(dimensions=4, candidates=40, seed=0)


def history(trials: int = 3) -> History:
    x = np.random.default_rng(1).random((trials, 4))
    return History(x, np.linspace(-1.0, 0.5, trials))


@pytest.mark.parametrize("name", sorted(set(SURROGATES) - {"saasbo"}) + sorted(LATENT_SURROGATES))
def test_every_surrogate_learns_from_a_few_trials(name):
    surrogate = {**SURROGATES, **LATENT_SURROGATES}[name](PROBLEM)
    posterior, _ = surrogate.after(history())
    mu, sigma = posterior.moments(surrogate.candidates.phi)
    assert mu.shape == sigma.shape == (len(surrogate.candidates.x),)
    assert torch.isfinite(mu).all()
    assert (sigma > 0).all()


def test_the_best_objective_is_told_in_the_surrogates_own_units():
    assert SURROGATES["se"](PROBLEM).after(history())[1] == pytest.approx(0.75)  # of limits -1 and 1
    assert SURROGATES["botorch"](PROBLEM).after(history())[1] == pytest.approx(0.5)


def test_kernels_have_a_lengthscale_for_every_number_that_is_compared():
    for make, count in ((on_controllers, 4), (on_paths, TAU_DIMENSIONS)):
        posterior, _ = make(kernels.se, PROBLEM).after(history())
        assert posterior.model.covar_module.base_kernel.lengthscale.numel() == count


def test_compressed_paths_are_latent_paths_times_their_goodness():
    x = torch.tensor(PROBLEM.pool).double()
    tau, y = latent_means(x)
    for make, features in ((on_paths, tau), (on_compressed_paths, (1 - y[:, None]) * tau)):
        candidates = make(kernels.se, PROBLEM).candidates
        torch.testing.assert_close(
            candidates.features_of(x) * candidates.unit, features, rtol=1e-5, atol=1e-6
        )


def test_screening_keeps_the_share_of_the_pool_that_is_predicted_least_bad():
    kept = on_screened_paths(kernels.se, PROBLEM).candidates.x
    assert len(kept) == LEAST_BAD * 40
    assert kept[:, 0].max() == np.sort(PROBLEM.pool[:, 0])[len(kept) - 1]  # large x_0 is bad


@pytest.mark.parametrize("name", sorted(LATENT_SURROGATES))
def test_a_surrogate_on_a_models_latents_refuses_a_problem_without_a_model(name):
    bare = replace(PROBLEM, latents=None, densities=None, adjustable=None)
    with pytest.raises(ValueError, match="must be those of a trained model"):
        LATENT_SURROGATES[name](bare)
