"""Bounds of ξ: those of the space, those that are given, and a proposal where some are missing."""

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces
from gymnasium.wrappers import TransformObservation

from tests.workers.environments.sled import ACTION, OBSERVATION, Sled
from workers.environments.environment import Channel
from workers.environments.gymnasium_bounds import bounded_channels

TORQUE = (Channel("torque", "N·m", -2.0, 2.0),)


def test_bounds_that_the_environment_has_are_taken():
    world = gymnasium.make("Pendulum-v1", disable_env_checker=True)
    assert bounded_channels(world, (), TORQUE, 10) == (
        Channel("observation1", "", -1.0, 1.0),
        Channel("observation2", "", -1.0, 1.0),
        Channel("observation3", "", -8.0, 8.0),
    )


def test_given_channels_stay_as_they_are():
    assert bounded_channels(Sled(), OBSERVATION, ACTION, 10) == OBSERVATION


def test_parts_of_a_dict_give_their_names():
    parts = spaces.Dict({"arm": spaces.Box(-1.0, 1.0, (2,)), "aim": spaces.Box(0.0, 3.0, (1,))})
    world = TransformObservation(Sled(), lambda o: {"arm": o, "aim": o[:1]}, parts)
    assert [(each.name, each.high) for each in bounded_channels(world, (), ACTION, 5)] == [
        ("aim1", 3.0),
        ("arm1", 1.0),
        ("arm2", 1.0),
    ]


def refusal(observation) -> str:
    with pytest.raises(ValueError, match="20 episodes of random commands propose") as caught:
        bounded_channels(Sled(fence=np.inf), observation, ACTION, 20)
    return str(caught.value)


def test_missing_bounds_are_named_and_the_proposal_can_be_copied():
    message = refusal(())
    assert "Sled has no finite bounds of observation1, observation2, and ξ needs some" in message
    made = eval(message.partition("observation=")[2], {"Channel": Channel})
    assert bounded_channels(Sled(), made, ACTION, 10) == made
    assert all(channel.low < -0.01 < 0.01 < channel.high < 10.0 for channel in made)


def test_too_few_channels_keep_their_names_in_the_proposal():
    message = refusal(OBSERVATION[:1])
    assert "observation must have a channel for each of the 2 numbers of Sled, got 1" in message
    assert 'Channel("position", "m", ' in message
    assert 'Channel("observation2", "", ' in message
