"""What each episode of a dataset is of, decided by seed and index alone."""

import numpy as np
import pytest

from workers import setups
from workers.draws import EPISODE, REPEAT, Draws
from workers.randomness import Stream, generator
from workers.rollout import draw

SETUP = setups.load("franka")


@pytest.mark.parametrize("index", [0, 1, 7])
def test_without_choices_an_episode_is_what_it_always_was(index):
    x, physics = Draws(3, 2).episode(SETUP, index)
    assert np.array_equal(x, generator(3, Stream.CONTROLLER, index // 2).random(48, dtype=np.float32))
    assert physics == SETUP.physics.draw(generator(3, Stream.PHYSICS, index))
    same_x, same_physics = draw(SETUP, 3, index, 2)
    assert np.array_equal(x, same_x)
    assert physics == same_physics


def test_controllers_share_their_worlds_where_each_repeat_has_physics_of_its_own():
    own, shared = (Draws(3, 3, of) for of in (EPISODE, REPEAT))
    physics = [shared.physics(SETUP.physics, index) for index in range(6)]
    assert physics[:3] == physics[3:]
    assert physics[0] != physics[1]
    assert physics[0] == own.physics(SETUP.physics, 0)
    assert own.physics(SETUP.physics, 3) != own.physics(SETUP.physics, 0)


def test_chosen_controllers_come_first_and_the_others_are_drawn_as_ever():
    chosen = np.full((2, 48), 0.25, dtype=np.float32)
    chosen[1] = 0.5
    draws = Draws(3, 2, chosen=chosen)
    assert [draws.controller(48, index)[0] for index in range(4)] == [0.25, 0.25, 0.5, 0.5]
    assert np.array_equal(draws.controller(48, 4), Draws(3, 2).controller(48, 4))
    draws.controller(48, 0)[:] = 0.0
    assert chosen[0, 0] == 0.25
