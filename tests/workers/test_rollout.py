"""What becomes of an episode whose simulation explodes."""

import doctest
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from workers import rollout, setups
from workers.environments.environment import Channel
from workers.environments.tabletop import Tabletop
from workers.rollout import random_episode
from workers.setups.franka import MODEL

CRASH = 200  # control step


class ExplodingTabletop(Tabletop):
    """The Franka scene, whose first object flies off at one step; the steps after it are nonsense."""

    nonsense = float("nan")

    def observed(self, records):
        observed = super().observed(records)
        if len(records) > CRASH:
            observed.xi[7:, CRASH:] = self.nonsense
        return observed


class DistantTabletop(ExplodingTabletop):
    """The same, but far away rather than not a number."""

    nonsense = 1e6


@pytest.fixture(scope="module", params=[ExplodingTabletop, DistantTabletop])
def setup(request):
    return replace(setups.load("franka"), build=partial(request.param, MODEL))


@pytest.fixture(scope="module")
def pair(setup):
    with setups.load("franka").open() as sane, setup.open() as exploding:
        return random_episode(setup, sane, 0, 1), random_episode(setup, exploding, 0, 1)


def test_a_diverged_episode_is_kept_as_entirely_bad_at_the_lower_limit(setup, pair):
    _, diverged = pair
    assert diverged.stop == "diverged"
    assert diverged.y == 1.0
    assert diverged.f == np.float32(setup.objective_limits[0])
    assert set(diverged.bad.tolist()) == {2 ** len(setup.conditions) - 1}


def test_its_last_sane_state_is_repeated(pair):
    sane, diverged = pair
    assert np.array_equal(diverged.xi[:, :CRASH], sane.xi[:, :CRASH])
    assert np.array_equal(
        diverged.xi[:, CRASH:], np.repeat(sane.xi[:, CRASH - 1 : CRASH], 500 - CRASH, axis=1)
    )
    assert np.isfinite(diverged.xi).all()


def test_an_episode_insane_from_its_first_step_still_has_finite_numbers(setup):
    class Hopeless(ExplodingTabletop):
        def observed(self, records):
            observed = super().observed(records)
            observed.xi[:] = self.nonsense
            return observed

    with Hopeless(MODEL) as environment:
        episode = random_episode(setup, environment, 0, 0)
    assert episode.stop == "diverged"
    for row, channel in zip(episode.xi, setup.observation, strict=True):
        assert channel.low < row[0] < channel.high
        assert np.all(row == row[0])


def test_the_next_episode_is_untouched_by_a_diverged_one(setup, pair):
    sane, _ = pair
    with setups.load("franka").open() as environment:
        environment.reset({name: low for name, (low, _) in setup.physics.intervals.items()})
        for _ in range(5):
            environment.step([float("nan")] * 7)
        after = random_episode(setup, environment, 0, 1)
    assert np.array_equal(after.xi, sane.xi)


def test_the_example_in_the_docstring_is_true():
    assert doctest.testmod(rollout).failed == 0
    assert doctest.testmod(rollout).attempted == 4


def test_a_channel_without_width_is_refused():
    with pytest.raises(ValueError, match="low < high"):
        Channel("height", "m", 1.0, 1.0)
