"""Processes that expect of a robot what simulation showed, and correct it by trials."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.bo import kernels, methods
from svaedc.bo.history import History
from svaedc.bo.simulated import prior
from svaedc.bo.simulated.outcomes import Lookup, SimulatedLatents, SimulatedOutcomes
from tests.svaedc.bo.fake_latents import problem

COUNT, WORLDS = 60, 4


def simulated_problem(f, dimensions=3, seed=0):
    given = problem(dimensions, COUNT, seed)
    y = torch.linspace(0, 1, f.numel()).reshape(f.shape)
    return replace(given, simulated=SimulatedOutcomes(f, y, Lookup(given.pool)))


def random_worlds(seed=0):
    return torch.tensor(np.random.default_rng(seed).uniform(-1, 1, (COUNT, WORLDS)))


def run(name, given, objective, count=6):
    method, history = methods.build(name, given), History.empty(3)
    for index in range(count):
        x = method.suggest(history, np.random.default_rng(index))
        history = history.append(x, objective(x))
    return history


def row(given, x):
    return int(np.flatnonzero((given.pool == x.astype(np.float32)).all(axis=1))[0])


@pytest.mark.parametrize(
    ("name", "score"),
    [
        ("simulated-best", lambda f, _: f.mean(dim=1)),
        ("simulated-cautious", lambda f, _: f.mean(dim=1) - f.std(dim=1, correction=0)),
        ("least-bad", lambda _, y: -y.mean(dim=1)),
    ],
)
def test_candidates_are_tried_in_the_order_of_their_score_whatever_the_trials_show(name, score):
    given = simulated_problem(random_worlds())
    order = score(given.simulated.f, given.simulated.y).argsort(descending=True)[:6].tolist()
    history = run(name, given, lambda x: float("nan") if row(given, x) == order[2] else 0.0)
    tried = [row(given, x) for x in history.tried]
    assert sorted(tried) == sorted(order)
    assert methods.build(name, given).suggest(History.empty(3), np.random.default_rng(9)).tobytes() == (
        given.pool[order[0]].tobytes()
    )


@pytest.mark.parametrize("kind", [prior.trust, prior.ensemble])
def test_far_from_all_trials_the_process_expects_what_simulation_showed(kind):
    f = random_worlds()
    surrogate = prior.on_controllers(kind, kernels.se, simulated_problem(f))
    posterior, _ = surrogate.after(History(surrogate.candidates.x[:1], np.array([float(f[0].mean())])))
    mu, sigma = posterior.moments(surrogate.candidates.phi)
    np.testing.assert_allclose(mu.numpy(), (f.mean(dim=1) + 1) / 2, atol=0.05)
    assert sigma[1:].min() > 0.05


def test_the_covariances_are_those_of_the_formulas():
    f, y = random_worlds().double(), random_worlds(1).double().abs()
    rows = torch.cat([f, y], dim=1)

    def worlds(rows):
        return prior.Worlds(*rows.chunk(2, dim=-1))

    trusted, ensemble = (
        prior.LinearKernel(worlds, kind)(rows).to_dense() for kind in (prior.trust, prior.ensemble)
    )
    mean, spread, bad = f.mean(dim=1), f.std(dim=1, correction=0), y.mean(dim=1)
    products = sum(torch.outer(each, each) for each in (mean, spread, bad))
    assert torch.allclose(trusted, prior.TRUST**2 * products + prior.SHIFT**2)
    assert torch.allclose(ensemble, torch.cov(f, correction=0) + prior.SHIFT**2)
    for kind, matrix in ((prior.trust, trusted), (prior.ensemble, ensemble)):
        assert torch.allclose(prior.LinearKernel(worlds, kind)(rows, diag=True), matrix.diagonal())


def test_a_robot_like_one_of_the_worlds_is_recognised_by_its_trials():
    f = random_worlds()
    given = simulated_problem(f)
    robot = f[:, 2]
    history = run("ensemble-se", given, lambda x: float(robot[row(given, x)]), count=8)
    blind = run("simulated-best", given, lambda x: float(robot[row(given, x)]), count=8)
    posterior, _ = methods.build("ensemble-se", given).surrogate.after(history)
    mu, _ = posterior.moments(methods.build("ensemble-se", given).surrogate.candidates.phi)
    expected = np.corrcoef(mu.numpy(), robot.numpy())[0, 1]
    assert expected > np.corrcoef(f.mean(dim=1).numpy(), robot.numpy())[0, 1] + 0.1
    assert history.f.max() >= blind.f.max()


@pytest.mark.parametrize("name", ["prior-se", "prior-svae", "prior-svae-dc", "ensemble-svae-dc"])
def test_every_prior_goes_on_from_its_history_alone(name):
    given = simulated_problem(random_worlds())
    history = run(name, given, lambda x: float(x[0]), count=4)
    one, other = (methods.build(name, given).suggest(history, np.random.default_rng(1)) for _ in range(2))
    assert np.array_equal(one, other)
    assert row(given, one) >= 0


@pytest.mark.parametrize(
    "name", ["simulated-best", "simulated-random", "least-bad", "prior-se", "ensemble-svae"]
)
def test_a_problem_without_simulated_candidates_is_refused_naming_the_command(name):
    with pytest.raises(ValueError, match=f"{name}.*`svaedc candidates`"):
        methods.build(name, replace(problem(3, 10, 0), simulated=None))


def given_latents(given):
    return given.latents.tau, given.latents.y, Lookup(given.pool)


def test_a_search_between_the_candidates_is_refused():
    given = simulated_problem(random_worlds())
    given = replace(given, latents=replace(given.latents, at=SimulatedLatents(*given_latents(given))))
    for name in ("prior-se-acqf", "svae-dc-acqf", "ensemble-svae-acqf"):
        with pytest.raises(ValueError, match=r"nothing was simulated.*leave `-acqf` out"):
            methods.build(name, given)
