"""Controllers near one that failed are not suggested; that every method keeps to it is in tests/contracts."""

from dataclasses import dataclass

import numpy as np
import pytest

from svaedc.bo.history import History
from svaedc.bo.methods import build
from svaedc.bo.strategies import Avoidance
from tests.svaedc.bo.fake_latents import problem

DISTANCE = 0.2


@dataclass
class Stubborn:
    """Always the same controller."""

    x: np.ndarray

    def suggest(self, *_):
        return self.x


def distance(one, other):
    return float(np.sqrt(np.mean((one - other) ** 2)))


def failed_at(*failed):
    history = History.empty(len(failed[0]))
    for number in range(3):
        history = history.append(np.full(len(failed[0]), 0.1 + 0.05 * number, np.float32), float(number))
    for x in failed:
        history = history.append(x, np.nan)
    return history


def test_without_a_failure_the_method_is_asked_with_its_own_generator():
    given = problem(4, 50, seed=3)
    method = build("se", given)
    history = History.empty(4).append(given.pool[0], 0.5).append(given.pool[1], 0.1)
    alone = method.suggest(history, np.random.default_rng(3))
    np.testing.assert_array_equal(
        Avoidance(method, given.pool, DISTANCE).suggest(history, np.random.default_rng(3)), alone
    )


def test_a_method_that_insists_is_replaced_by_chance():
    x = np.full(3, 0.5, np.float32)
    suggested = Avoidance(Stubborn(x), np.empty((0, 3), np.float32), DISTANCE).suggest(
        failed_at(x), np.random.default_rng(0)
    )
    assert distance(suggested, x) >= DISTANCE


def test_a_distance_that_leaves_nothing_is_refused_with_the_remedy():
    x = np.full(3, 0.5, np.float32)
    with pytest.raises(ValueError, match="ask for a smaller distance"):
        Avoidance(Stubborn(x), np.empty((0, 3), np.float32), 1.0).suggest(
            failed_at(x), np.random.default_rng(0)
        )


def test_a_distance_of_zero_is_the_method_alone():
    x = np.full(3, 0.5, np.float32)
    avoiding = Avoidance(Stubborn(x), np.empty((0, 3), np.float32), 0.0)
    np.testing.assert_array_equal(avoiding.suggest(failed_at(x), np.random.default_rng(0)), x)
