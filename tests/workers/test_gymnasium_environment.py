"""The Gymnasium adapter where its rollouts explode; tests/contracts holds the rest."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from workers import setups
from workers.environments.tabletop import Tabletop
from workers.gymnasium_environment import SetupEnvironment
from workers.randomness import Stream, generator
from workers.rollout import rollout
from workers.setups.franka import MODEL

CRASH = 40  # control step


class ExplodingTabletop(Tabletop):
    """The Franka scene, whose arm is flung away at one step of every episode."""

    def reset(self, physics):
        super().reset(physics)
        self._steps = 0

    def step(self, command):
        self._steps += 1
        return super().step(command if self._steps <= CRASH else [float("nan")] * len(command))


@pytest.fixture
def setup():
    return replace(setups.load("franka"), build=partial(ExplodingTabletop, MODEL))


def test_an_episode_that_explodes_ends_with_the_reward_that_a_rollout_has_for_f(setup):
    adapter = SetupEnvironment(setup)
    _, info = adapter.reset(seed=1)
    x = generator(0, Stream.CONTROLLER, 1).random(setup.dimensions, dtype=np.float32)
    with setup.open() as environment:
        episode = rollout(setup, environment, x, info["physics"])
    assert episode.stop == "diverged"
    rewards, observations, ended = [], [], False
    while not ended:
        observation, reward, terminated, truncated, info = adapter.step(np.zeros(7, dtype=np.float32))
        rewards.append(reward)
        observations.append(observation)
        ended = terminated or truncated
    adapter.close()
    assert terminated
    assert not truncated
    assert info["bad"]
    assert CRASH < len(rewards) < setup.horizon
    assert sum(rewards) == rewards[-1] == episode.f
    assert all(adapter.observation_space.contains(observation) for observation in observations)
    assert np.array_equal(observations[-1], observations[-2])


def test_the_episode_after_an_explosion_is_a_whole_one_again():
    sane = SetupEnvironment(setups.load("franka"))
    sane.reset(seed=1)
    expected = [sane.step(np.ones(7, dtype=np.float32)) for _ in range(20)]
    sane.reset(seed=1)
    *_, terminated, _, _ = sane.step(np.full(7, np.nan, dtype=np.float32))
    assert terminated
    sane.reset(seed=1)
    again = [sane.step(np.ones(7, dtype=np.float32)) for _ in range(20)]
    sane.close()
    assert all(np.array_equal(one[0], other[0]) for one, other in zip(expected, again, strict=True))
