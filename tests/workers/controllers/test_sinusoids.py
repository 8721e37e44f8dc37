"""Commands that swing about a centre."""

import numpy as np
import pytest

from workers.controllers.sinusoids import Sinusoids
from workers.environments.environment import Channel
from workers.environments.point import Point

ACTION = (Channel("hip", "N·m", -2.0, 2.0), Channel("knee", "N·m", 0.0, 10.0))


def controller() -> Sinusoids:
    return Sinusoids(ACTION, frequency=(1.0, 3.0), amplitude=0.5, center=0.2)


def test_ranges_are_shares_of_half_of_each_channel_about_its_middle():
    ranges = {each.name: (each.low, each.high) for each in controller().parameters}
    assert ranges["hip_amplitude"] == (0.0, 1.0)
    assert ranges["knee_amplitude"] == (0.0, 2.5)
    assert ranges["hip_center"] == pytest.approx((-0.4, 0.4))
    assert ranges["knee_center"] == pytest.approx((4.0, 6.0))
    assert ranges["frequency"] == (1.0, 3.0)


def test_commands_are_the_sines_that_the_parameters_say():
    x = np.full(7, 0.5, dtype=np.float32)
    x[[0, 1, 2, 4, 5]] = 0.5, 1.0, 0.5, 1.0, 0.75  # 2 Hz; phases 0 and a quarter turn
    seconds = np.linspace(0.0, 1.0, 101)
    hip, knee = controller().plan(x, seconds).T
    assert hip == pytest.approx(np.sin(4 * np.pi * seconds), abs=1e-6)
    assert knee == pytest.approx(5.0 + 2.5 * np.cos(4 * np.pi * seconds), abs=1e-6)


def test_the_time_between_commands_is_that_of_the_environment():
    class Slow(Point):
        control_step = 0.25

    x = np.array([0.0, 1.0, 0.5, 0.5, 0.0, 0.5, 0.5], dtype=np.float32)  # 1 Hz
    command = controller().start(x, Slow(1), 4)
    assert [command(step)[0] for step in range(4)] == pytest.approx([0.0, 1.0, 0.0, -1.0], abs=1e-6)


def test_commands_are_clipped_to_their_channels():
    wide = Sinusoids(ACTION, frequency=(1.0, 3.0), amplitude=1.0, center=1.0)
    commands = wide.plan(np.ones(7, dtype=np.float32), np.linspace(0.0, 1.0, 50))
    assert commands.max(axis=0).tolist() == [2.0, 10.0]
    assert commands.min(axis=0).tolist() == pytest.approx([0.0, 5.0], abs=0.1)


@pytest.mark.parametrize("share", [0.0, -0.5, 1.5, float("nan")])
def test_a_share_beyond_half_a_range_is_refused(share):
    with pytest.raises(ValueError, match=r"amplitude must be a share of half a range, in \(0, 1\]"):
        Sinusoids(ACTION, frequency=(1.0, 3.0), amplitude=share, center=0.2)
