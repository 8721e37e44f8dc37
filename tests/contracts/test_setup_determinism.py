"""An episode is a function of its seed and index: in any order and after others.

That it is the same in another process is one of the checks of `test_conformance`.
"""

import numpy as np
import pytest

from workers.episode import Episode
from workers.rollout import random_episode


def _bytes(episode: Episode) -> bytes:
    numbers = np.array([episode.y, episode.f])
    return b"".join(part.tobytes() for part in (episode.x, episode.xi, episode.bad, numbers))


def test_different_controllers_move_differently(episodes):
    assert len({_bytes(episode) for episode in episodes}) == len(episodes)


def test_episodes_are_bit_identical_in_reverse_order_and_after_others(setup, environment, episodes):
    for index in reversed(range(len(episodes))):
        assert _bytes(random_episode(setup, environment, 0, index)) == _bytes(episodes[index])


@pytest.mark.slow
def test_thousands_of_shuffled_episodes_leave_nothing_behind(whole, environment):
    """Each of 200 episodes runs ten times in shuffled order, and equals itself in a simulation of its own."""
    expected = {}
    for index in range(200):
        with whole.open() as fresh:
            expected[index] = _bytes(random_episode(whole, fresh, 1, index))
    order = np.tile(np.arange(200), 10)
    np.random.default_rng(0).shuffle(order)
    for index in order.tolist():
        assert _bytes(random_episode(whole, environment, 1, index)) == expected[index], index
