"""The registry of robots."""

import pytest

from workers.hardware import robots


def test_an_unknown_robot_is_refused_with_the_nearest_name():
    with pytest.raises(
        LookupError, match=r"unknown robot 'franka-rehersal'.*did you mean 'franka-rehearsal'\?"
    ):
        robots.find("franka-rehersal")
