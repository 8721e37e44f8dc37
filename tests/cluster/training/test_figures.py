"""Which channels a picture of a model shows."""

from dataclasses import replace

import numpy as np
import pytest

from cluster.training.figures import _moving_channels
from svaedc.data.episodes import Episodes
from workers import setups
from workers.dataset.identity import identity_of


@pytest.mark.parametrize(
    ("units", "shown"),
    [
        (("rad", "rad", "m", "m", "m", "1"), [1, 4, 3, 5]),
        (("N", "N", "N", "N", "N", "m"), [5]),
        (("rad/s", "N", "", "rad/s", "N", "rad/s"), [5, 4, 3, 2]),
        (("N", "N"), [1, 0]),
    ],
)
def test_a_picture_shows_channels_of_the_usual_units_and_without_any_those_that_move_most(units, shown):
    """Channel i moves i times as far as channel 1."""
    identity = replace(
        identity_of(setups.load("franka"), seed=0, episodes_per_shard=8),
        observation=tuple((f"c{index}", unit, -9.0, 9.0) for index, unit in enumerate(units)),
    )
    steps = np.array([-1.0, 1.0, -1.0, 1.0], np.float32)
    xi = np.stack([index * steps for index in range(len(units))])[None].repeat(3, axis=0)
    bad, y = np.zeros((3, 4), np.float32), np.zeros(3, np.float32)
    held_out = Episodes(np.zeros((3, 2), np.float32), xi, bad, y, np.arange(3))
    assert _moving_channels(held_out, identity) == shown
