"""An environment of Gymnasium as a setup: what is taken from it, what must be said, and its episodes."""

from functools import partial
from pathlib import Path

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from tests.workers.environments.sled import ACTION, OBSERVATION, Sled, vary_mass
from workers.controllers.waypoints import Waypoints
from workers.environments.environment import Channel
from workers.gymnasium_setup import gymnasium_setup, has_terminated
from workers.physics import PhysicsRanges
from workers.pictures import Size, frames
from workers.rollout import random_episode, rollout

PENDULUM = partial(gymnasium.make, "Pendulum-v1", disable_env_checker=True)
TORQUE = (Channel("torque", "N·m", -2.0, 2.0),)


def sled_setup(make=Sled, **options):
    given = {
        "action": ACTION,
        "observation": OBSERVATION,
        "controller": Waypoints(ACTION, 3),
        "bad": {"over_the_fence": has_terminated, "fast": lambda observed: abs(observed.xi[1]) > 0.5},
        "horizon": 40,
        "objective_limits": (-40.0, 0.0),
        "success": -10.0,
    }
    return gymnasium_setup(make, **given | options)


def pendulum_setup(**options):
    return sled_setup(
        PENDULUM,
        **{"action": TORQUE, "observation": (), "controller": Waypoints(TORQUE, 3), "horizon": 200} | options,
    )


def episode_of(setup, x):
    with setup.open() as environment:
        return rollout(setup, environment, np.array(x, np.float32), setup.physics.middle())


def test_name_time_and_bounds_come_from_the_environment():
    setup = pendulum_setup()
    assert (setup.name, setup.control_step, setup.horizon) == ("Pendulum-v1", 0.05, 200)
    assert [channel.high for channel in setup.observation] == [1.0, 1.0, 8.0]
    assert setup.conditions == ("over_the_fence", "fast")
    assert setup.gaps.keys() == {"paper", "training", "wide"}


def test_f_is_the_sum_of_rewards_and_a_terminated_episode_is_bad_to_its_horizon():
    episode = episode_of(sled_setup(), [1.0, 1.0, 1.0])
    over = np.flatnonzero(episode.bad & 1)
    assert over.tolist() == list(range(over[0], 40))
    assert 5 < over[0] < 35
    assert episode.f == -(over[0] + 1)
    assert episode.stop == ""
    assert episode.y == pytest.approx(np.count_nonzero(episode.bad) / 40)


def test_an_objective_of_ones_own_sees_signals_and_bad_steps():
    def worth(observed, bad):
        return float(observed.signals["effort"].sum() - bad[1].sum())

    episode = episode_of(sled_setup(objective=worth, info=("effort",)), [0.5, 0.5, 0.5])
    assert episode.f == 0.0
    assert episode_of(sled_setup(objective=worth, info=("effort",)), [0.0, 0.5, 1.0]).f != 0.0


def test_episodes_depend_on_seed_and_index_alone_although_the_environment_wears():
    ranges = PhysicsRanges({"mass": (0.5, 2.0), "start": (0.0, 100.0)})
    setup = sled_setup(physics=ranges, apply=vary_mass)
    with setup.open() as environment:
        there = [random_episode(setup, environment, 3, index) for index in range(5)]
        back = [random_episode(setup, environment, 3, index) for index in reversed(range(5))]
    for one, other in zip(there, reversed(back), strict=True):
        assert one.xi.tobytes() == other.xi.tobytes()
        assert (one.f, one.y, one.physics) == (other.f, other.y, other.physics)
    assert len({episode.xi.tobytes() for episode in there}) == 5


def test_an_observation_that_is_not_a_number_is_a_diverged_episode():
    class Broken(Sled):
        def step(self, action):
            seen, *rest = super().step(action)
            return (seen * np.nan if seen[0] > 0.1 else seen), *rest

    assert episode_of(sled_setup(Broken), [1.0, 1.0, 1.0]).stop == "diverged"


def test_bounds_that_nobody_knows_are_asked_for_with_a_proposal():
    with pytest.raises(ValueError, match="Sled has no finite bounds of observation1, observation2"):
        sled_setup(observation=())


def test_a_horizon_beyond_the_time_limit_is_refused_with_the_remedy():
    with pytest.raises(
        ValueError, match=r"at most the 200 steps .* got 300; make it with max_episode_steps=300"
    ):
        pendulum_setup(horizon=300)
    make = partial(gymnasium.make, "Pendulum-v1", disable_env_checker=True, max_episode_steps=300)
    longer = sled_setup(make, action=TORQUE, observation=(), controller=Waypoints(TORQUE, 3), horizon=300)
    assert longer.horizon == 300


def test_a_step_of_unknown_length_must_be_told():
    class Timeless(Sled):
        dt = None

    with pytest.raises(ValueError, match="Timeless does not say how long a step is; give control_step, in s"):
        sled_setup(Timeless)
    assert sled_setup(Timeless, control_step=0.5).control_step == 0.5


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        ({}, "bad must name at least one condition, got none"),
        (
            {"fast": lambda observed: observed.xi[1]},
            r"'fast' must return one boolean per step, .* got float32",
        ),
        ({"fast": lambda observed: observed.xi > 0.5}, r"bool of shape \(40,\), got bool of shape \(2, 40\)"),
    ],
)
def test_conditions_that_are_none_are_refused_by_name(bad, message):
    with pytest.raises(ValueError, match=message):
        episode_of(sled_setup(bad=bad), [0.5, 0.5, 0.5])


@pytest.mark.parametrize("bounds", [(-1.5, 1.0), (-1.0, 1.5)])
def test_commands_that_the_environment_does_not_take_are_refused_by_name(bounds):
    with pytest.raises(ValueError, match=r"force must lie within \[-1, 1\], those of Sled, got \["):
        sled_setup(action=(Channel("force", "N", *bounds),))


def test_bounds_that_the_environment_has_in_float32_are_taken_in_decimals():
    class Weak(Sled):
        def __init__(self):
            super().__init__()
            self.action_space = spaces.Box(-0.7, 0.7, (1,), np.float32)

    assert sled_setup(Weak, action=(Channel("force", "N", -0.7, 0.7),)).dimensions == 3


def test_too_many_commands_are_refused_before_bounds_are_proposed():
    with pytest.raises(
        ValueError, match="action must have a channel for each of the 1 numbers of Sled, got 2"
    ):
        sled_setup(action=ACTION * 2, observation=())


def test_physics_that_nothing_applies_is_refused_but_for_the_start():
    with pytest.raises(ValueError, match="physics has mass, and nothing puts that into the environment"):
        sled_setup(physics=PhysicsRanges({"mass": (0.5, 2.0), "start": (0.0, 9.0)}))
    assert sled_setup(physics=PhysicsRanges({"start": (0.0, 9.0)})).physics.intervals.keys() == {"start"}


def test_the_setup_of_the_documentation_runs_and_is_drawn():
    page = (Path(__file__).parents[2] / "docs" / "how-to" / "gymnasium.md").read_text(encoding="utf-8")
    module = {}
    exec(page.split("```python\n")[1].split("```")[0], module)
    setup = module["setup"]()
    with setup.open() as environment:
        one, other = (random_episode(setup, environment, 0, index) for index in range(2))
    assert one.f != other.f
    assert 0.0 < one.y < 1.0
    first, last = frames(setup, one.xi, [0, 199], Size(64, 48))
    assert (first != last).any()
