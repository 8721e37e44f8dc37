"""What simulation leaves is learnt of candidates that do nearly the same, and of no others."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.bo import methods
from svaedc.bo.history import History
from svaedc.bo.simulated import residual
from svaedc.bo.simulated.outcomes import Lookup, SimulatedOutcomes
from tests.svaedc.bo.fake_latents import problem

COUNT = 60
NAMES = ["residual-svae", "residual-svae-dc"]


def simulated_problem(seed=0):
    given = problem(3, COUNT, seed)
    f = torch.tensor(np.random.default_rng(seed).uniform(-1, 1, (COUNT, 4)))
    return replace(given, simulated=SimulatedOutcomes(f, torch.rand(COUNT, 4).double(), Lookup(given.pool)))


def cautious(given):
    """f - s / 2, in parts of the range of objectives."""
    low, high = given.objective_limits
    f = (given.simulated.f - low) / (high - low)
    return f.mean(dim=1) - residual.CAUTION * f.std(dim=1, correction=0)


@pytest.mark.parametrize("name", NAMES)
def test_a_trial_that_shows_what_simulation_did_changes_nothing(name):
    given, low_high = simulated_problem(), problem(3, COUNT, 0).objective_limits
    order = cautious(given).argsort(descending=True).tolist()
    shown = float(cautious(given)[order[0]]) * (low_high[1] - low_high[0]) + low_high[0]
    history = History.empty(3).append(given.pool[order[0]], shown)
    x = methods.build(name, given).suggest(history, np.random.default_rng(0))
    assert np.array_equal(x, given.pool[order[1]])


@pytest.mark.parametrize("name", NAMES)
def test_the_posterior_is_the_textbook_s(name):
    given = simulated_problem()
    surrogate = methods.build(name, given).surrogate
    rows = [3, 17, 40]
    history = History.empty(3)
    for row in rows:
        history = history.append(given.pool[row], 0.1 * row)
    posterior, _ = surrogate.after(history)
    phi = surrogate.candidates.phi
    compared = phi[:, : phi.shape[1] - 8]
    distance = torch.cdist(compared, compared).square()
    k = residual.SCALE**2 * torch.exp(-0.5 * distance / residual.LENGTHSCALE**2) + residual.SHIFT**2
    low, high = given.objective_limits
    f = (torch.tensor(history.f) - low) / (high - low)
    inverse = torch.linalg.inv(k[rows][:, rows] + residual.NOISE**2 * torch.eye(3).double())
    expected = cautious(given) + k[:, rows] @ inverse @ (f - cautious(given)[rows])
    mu, _ = posterior.moments(phi)
    assert torch.allclose(mu, expected, atol=1e-9)


def test_candidates_are_needed_and_latents_of_an_svae_dc():
    with pytest.raises(ValueError, match=r"residual-svae-dc.*`svaedc candidates`"):
        methods.build("residual-svae-dc", replace(simulated_problem(), simulated=None))
