"""What decides a run's controllers: its setup, method and seed, and nothing else."""

import numpy as np
import pytest

from cluster.optimization.factory import Optimization
from svaedc.bo.history import History
from workers import setups
from workers.randomness import Stream, generator

SETUP = setups.load("quadratic-30d")


def test_the_first_controllers_are_shared_by_all_methods_of_a_seed():
    one, other = (Optimization(SETUP, method, 3, 10) for method in ("random", "se"))
    assert np.array_equal(one.initial(1), other.initial(1))
    assert not np.array_equal(one.initial(1), one.initial(0))
    assert not np.array_equal(one.initial(1), Optimization(SETUP, "random", 4, 10).initial(1))
    assert np.array_equal(one.initial(1), generator(3, Stream.INITIAL, 1).random(30, dtype=np.float32))


def test_controllers_of_the_first_version_are_drawn_in_double_precision():
    old = Optimization(SETUP, "random", 3, 10, draws=1)
    assert np.array_equal(old.initial(0), generator(3, Stream.INITIAL, 0).random(30).astype(np.float32))
    assert np.array_equal(
        old.problem().pool, generator(3, Stream.POOL, 0).random((10, 30)).astype(np.float32)
    )
    assert not np.array_equal(old.problem().pool, Optimization(SETUP, "random", 3, 10).problem().pool)


def test_a_suggestion_is_a_function_of_seed_and_trial():
    history = History.empty(30).append(np.full(30, 0.5, np.float32), 1.0)
    run = Optimization(SETUP, "random", 3, 10)
    first, again, later = (run.build().suggest(history, run.rng(index)) for index in (1, 1, 2))
    assert np.array_equal(first, again)
    assert not np.array_equal(first, later)


def test_an_unknown_method_and_one_that_lacks_its_model_are_refused():
    with pytest.raises(LookupError, match="did you mean 'svae-dc'"):
        Optimization(SETUP, "svae-cd", 0, 10).build()
    with pytest.raises(ValueError, match="must be those of a trained model"):
        Optimization(SETUP, "svae-dc", 0, 10).build()
