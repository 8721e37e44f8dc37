"""Commands that are weighted sums of what is seen."""

import numpy as np
import pytest

from workers.controllers.linear_feedback import LinearFeedback
from workers.environments.environment import Channel
from workers.environments.point import Point, coordinates

SEEN = coordinates(3)
ACTION = (Channel("left", "N", -1.0, 1.0), Channel("right", "N", -20.0, 20.0))


def controller() -> LinearFeedback:
    return LinearFeedback(SEEN, ACTION, gains={"x3": (0.0, 4.0), "x1": (-10.0, 10.0)}, bias=(-2.0, 2.0))


def at(place) -> Point:
    """Something seen: a point that stands at a place of the cube."""
    point = Point(3)
    point.reset({})
    point.step(place)
    return point


def test_every_command_has_a_gain_for_each_channel_fed_back_and_a_bias():
    names = [(each.name, each.unit) for each in controller().parameters]
    assert names == [
        ("left_per_x3", "N/(1)"),
        ("left_per_x1", "N/(1)"),
        ("left_bias", "N"),
        ("right_per_x3", "N/(1)"),
        ("right_per_x1", "N/(1)"),
        ("right_bias", "N"),
    ]


def test_a_command_is_the_sum_of_gains_times_what_is_seen_and_the_bias():
    x = np.array([0.5, 0.5, 0.75, 1.0, 0.0, 1.0], dtype=np.float32)  # 2, 0, 1; 4, −10, 2
    command = controller().start(x, at((0.25, 0.9, 0.5)), 10)
    assert command(0) == [1.0, 4 * 0.5 - 10 * 0.25 + 2]  # left: 2 · 0.5 + 1, clipped


def test_it_answers_to_what_is_seen_now():
    x = np.full(6, 0.5, dtype=np.float32)
    x[3] = 1.0
    point = at((0.0, 0.0, 0.0))
    command = controller().start(x, point, 10)
    answers = [command(0)[1]]
    point.step((0.0, 0.0, 1.0))
    answers.append(command(1)[1])
    assert answers == [0.0, 4.0]


def test_a_channel_that_is_not_in_xi_is_refused():
    with pytest.raises(ValueError, match=r"gains must name channels of ξ, got 'angel'; .* x1, x2, x3"):
        LinearFeedback(SEEN, ACTION, gains={"x1": (0.0, 1.0), "angel": (0.0, 1.0)}, bias=(-1.0, 1.0))
