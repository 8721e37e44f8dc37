"""Commands on straight lines through waypoints."""

import numpy as np
import pytest

from workers.controllers.waypoints import Waypoints
from workers.environments.environment import Channel

ACTION = (Channel("left", "N", -1.0, 1.0), Channel("right", "N", 0.0, 10.0))


def test_the_first_and_the_last_command_are_waypoints_and_those_between_lie_on_lines():
    controller = Waypoints(ACTION, 3)
    x = np.array([0.0, 0.0, 1.0, 0.5, 0.5, 1.0], dtype=np.float32)
    command = controller.start(x, None, 5)
    assert [command(step) for step in range(5)] == [
        [-1.0, 0.0],
        [0.0, 2.5],
        [1.0, 5.0],
        [0.5, 7.5],
        [0.0, 10.0],
    ]


def test_every_parameter_is_named_after_its_waypoint_and_channel():
    names = [parameter.name for parameter in Waypoints(ACTION, 2).parameters]
    assert names == ["waypoint1_left", "waypoint1_right", "waypoint2_left", "waypoint2_right"]
    assert [parameter.unit for parameter in Waypoints(ACTION, 2).parameters] == ["N"] * 4


def test_a_single_waypoint_is_refused():
    with pytest.raises(ValueError, match="count must be at least 2 waypoints, a first and a last, got 1"):
        Waypoints(ACTION, 1)
