"""What every method obeys, whatever it does inside."""

import numpy as np
import pytest
import torch

from svaedc.bo import methods
from svaedc.bo.history import History
from svaedc.bo.strategies import Avoidance
from tests.svaedc.bo.fake_latents import problem, quadratic

DIMENSIONS, CANDIDATES = 4, 60
OFF_POOL = {"random", "botorch", "saasbo", "turbo", "se-acqf", "matern-acqf"}
ON_POOL = [name for name in methods.names() if name not in OFF_POOL]
OTHER_SEARCH = ["svae-acqf", "screened-svae-acqf", "lkl-acqf", "botorch-pool", "turbo-pool"]
DISTANCE = 0.1
OTHER_ACQUISITION = ["se-ei", "svae-dc-acqf-ei", "bbk-kl-ei", "botorch-ucb", "turbo-pool-ucb"]


def history(count):
    grown = History.empty(DIMENSIONS)
    for x in np.random.default_rng(5).random((count, DIMENSIONS), dtype=np.float32):
        grown = grown.append(x, quadratic(x))
    return grown


def distance(one, other):
    """The root mean square difference of two controllers' parameters."""
    return float(np.sqrt(np.mean((one - other) ** 2)))


def built(name):
    return methods.build(name, problem(DIMENSIONS, CANDIDATES, seed=3))


# A suggestion of saasbo takes seconds: it is left to make test-slow.
every_method = pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=pytest.mark.slow) if name == "saasbo" else name for name in methods.names()],
)


@every_method
@pytest.mark.parametrize("count", [0, 6])
def test_suggestion_is_a_controller_in_the_unit_cube(name, count):
    x = built(name).suggest(history(count), np.random.default_rng(0))
    assert x.shape == (DIMENSIONS,)
    assert x.dtype == np.float32
    assert ((x >= 0) & (x <= 1)).all()


@every_method
def test_suggestion_depends_on_history_and_generator_alone(name):
    method = built(name)
    first = method.suggest(history(5), np.random.default_rng(1))
    method.suggest(history(3), np.random.default_rng(2))
    torch.manual_seed(99)
    np.testing.assert_array_equal(method.suggest(history(5), np.random.default_rng(1)), first)
    np.testing.assert_array_equal(built(name).suggest(history(5), np.random.default_rng(1)), first)


@every_method
def test_suggesting_changes_neither_history_nor_pool_nor_torch(name):
    given = problem(DIMENSIONS, CANDIDATES, seed=3)
    pool, tau, past = given.pool.copy(), given.latents.tau.clone(), history(4)
    x, f, state = past.x.copy(), past.f.copy(), torch.get_rng_state()
    suggested = methods.build(name, given).suggest(past, np.random.default_rng(0))
    suggested[:] = 0
    np.testing.assert_array_equal(given.pool, pool)
    assert torch.equal(given.latents.tau, tau)
    np.testing.assert_array_equal(past.x, x)
    np.testing.assert_array_equal(past.f, f)
    assert torch.equal(torch.get_rng_state(), state)


@every_method
def test_suggestions_are_all_different(name):
    method, grown = built(name), history(2)
    for index in range(3):
        x = method.suggest(grown, np.random.default_rng(index))
        assert not (grown.tried == x).all(axis=1).any()
        # A flat objective tempts an optimiser to stay.
        grown = grown.append(x, 0.2)


@pytest.mark.parametrize("name", [*ON_POOL, "botorch", "turbo", "se-acqf"])
def test_controller_that_failed_is_not_suggested_again(name):
    method, grown = built(name), history(3)
    failed = method.suggest(grown, np.random.default_rng(0))
    again = method.suggest(grown.append(failed, float("nan")), np.random.default_rng(0))
    assert not np.array_equal(again, failed)


@pytest.mark.parametrize("name", [*ON_POOL, "botorch-pool"])
def test_method_on_a_pool_suggests_its_controllers_bit_for_bit(name):
    given = problem(DIMENSIONS, CANDIDATES, seed=3)
    method = methods.build(name, given)
    for count in (0, 3):
        x = method.suggest(history(count), np.random.default_rng(0))
        assert (given.pool == x).all(axis=1).any()


@pytest.mark.parametrize("name", [*OTHER_SEARCH, *OTHER_ACQUISITION])
def test_every_method_searches_the_pool_or_by_gradients_as_asked(name):
    given = problem(DIMENSIONS, CANDIDATES, seed=3)
    x = methods.build(name, given).suggest(history(5), np.random.default_rng(0))
    of_the_pool = name in {"botorch-pool", "se-ei", "bbk-kl-ei"}  # that of turbo is squeezed into its box
    assert (given.pool == x).all(axis=1).any() == of_the_pool


@pytest.mark.parametrize("name", ["se", "botorch", "turbo", "lkl"])
def test_repeated_controllers_with_different_outcomes_are_no_obstacle(name):
    grown = history(3)
    for f in (0.1, 0.9, 0.9):
        grown = grown.append(np.full(DIMENSIONS, 0.5, dtype=np.float32), f)
    x = built(name).suggest(grown, np.random.default_rng(0))
    assert ((x >= 0) & (x <= 1)).all()


@every_method
def test_nothing_near_a_controller_that_failed_is_suggested_by_any_method(name):
    past, pool = history(4), problem(DIMENSIONS, CANDIDATES, seed=3).pool
    avoiding = Avoidance(built(name), pool, DISTANCE)
    for index in range(4):
        x = avoiding.suggest(past, np.random.default_rng(index))
        assert all(distance(x, failed) >= DISTANCE for failed in past.failed)
        past = past.append(x, np.nan)
