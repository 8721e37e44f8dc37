"""What every setup must obey, whatever its robot: what it says of itself, and what its episodes are."""

import numpy as np
import pytest

from workers import setups
from workers.environments.environment import Observed
from workers.tasks.stop import STOPPED, never


def test_setup_describes_itself_consistently(setup):
    assert setup.dimensions == len(setup.controller.parameters)
    assert setup.objective_limits[0] < setup.success < setup.objective_limits[1]
    assert 1 <= len(setup.conditions) <= 8
    assert {"paper", "training", "wide"} <= set(setup.gaps)
    for gap in setup.gaps.values():
        assert gap.intervals.keys() == setup.physics.intervals.keys()
    names = [channel.name for channel in setup.observation]
    assert len(set(names)) == len(names)


def test_unknown_gap_level_is_refused_with_the_nearest(setup):
    with pytest.raises(LookupError, match="did you mean 'paper'"):
        setup.gap("papr")


def test_trajectories_have_the_channels_and_the_horizon_of_the_setup(setup, episodes):
    for episode in episodes:
        assert episode.xi.shape == (len(setup.observation), setup.horizon)
        assert episode.xi.dtype == np.float32
        assert episode.x.shape == (setup.dimensions,)
        assert episode.x.dtype == np.float32
        assert episode.bad.shape == (setup.horizon,)
        assert episode.stop == "" or setup.stop is not never


def test_only_stand_ins_for_hardware_end_early(setup):
    assert (setup.stop is never) or setup.name.endswith("-rehearsal")
    assert (setup.stop is never) == (STOPPED not in setup.conditions)


def test_an_episode_is_stopped_from_the_step_of_its_reason_to_its_end(setup, episodes):
    for episode in (each for each in episodes if each.stop):
        stopped = np.flatnonzero(episode.bad >> setup.conditions.index(STOPPED) & 1)
        assert stopped.tolist() == list(range(stopped[0], setup.horizon))
        assert np.all(episode.bad[stopped[1:]] == episode.bad[-1])
        assert np.all(episode.xi[:, stopped] == episode.xi[:, -1:])
    for episode in (each for each in episodes if not each.stop and STOPPED in setup.conditions):
        assert not np.any(episode.bad >> setup.conditions.index(STOPPED) & 1)


def test_trajectories_stay_within_the_bounds_of_their_channels(setup, episodes):
    for row, channel in enumerate(setup.observation):
        values = np.concatenate([episode.xi[row] for episode in episodes])
        assert values.min() >= channel.low - 1e-5, channel.name
        assert values.max() <= channel.high + 1e-5, channel.name


def test_badness_is_the_share_of_steps_with_a_bad_bit(episodes):
    for episode in episodes:
        assert episode.y == pytest.approx(np.count_nonzero(episode.bad) / len(episode.bad), abs=1e-12)


def test_bad_bits_name_only_conditions_of_the_setup(setup, episodes):
    for episode in episodes:
        assert int(episode.bad.max()) < 2 ** len(setup.conditions)


def test_objectives_of_a_few_episodes_fit_the_scale_of_bo_and_are_exact_in_float32(setup, episodes):
    """Of six: the limits are those of a scale, and rare episodes of some setups lie outside."""
    low, high = setup.objective_limits
    for episode in episodes:
        assert np.float32(low) <= episode.f <= np.float32(high)
        assert episode.f == float(np.float32(episode.f))


def test_a_push_or_walk_the_wanted_way_is_worth_more_than_the_other_way(setup, episodes):
    """Franka pushes towards −y, the others towards +y; everything else stays as it was in the first step."""
    moved = ("object1_y", "body_y", "puck_y")
    y = [row for row, channel in enumerate(setup.observation) if channel.name in moved]
    if not y:
        pytest.skip("a formula has nothing that moves")
    sign = -1.0 if setup.name.startswith("franka") else 1.0
    with setup.open() as scene:
        scene.reset(episodes[0].physics)
        seen = scene.observed([scene.record()])
        worth = [
            setup.task.objective(_moved(seen, y, sign * 0.1 * way), np.zeros((8, 1), bool))
            for way in (-1, 0, 1)
        ]
    scale = 10.0 if setup.name.startswith("daisy") else 1.0
    assert np.diff(worth) == pytest.approx([0.1 * scale] * 2, abs=1e-5)


def _moved(observed: Observed, rows: list[int], metres: float) -> Observed:
    xi = observed.xi.copy()
    xi[rows] += np.float32(metres)
    return Observed(xi, observed.signals)


def test_nothing_touches_but_what_stands_on_the_ground_at_the_start(setup, episodes):
    """No condition is bad before the first command, and objects that nobody touches stay where they are."""
    with setup.open() as scene:
        scene.reset(episodes[0].physics)
        seen = scene.observed([scene.record()])
    assert not setup.task.is_bad(seen).any()
    assert setup.stop(seen) == ""


def test_angles_are_bounded_as_radians_are(setup):
    """A joint turns less than twice around; in degrees its bounds would be tens to hundreds."""
    for channel in (*setup.observation, *setup.controller.parameters):
        if channel.unit == "rad":
            assert max(abs(channel.low), abs(channel.high)) < 4 * np.pi, channel.name


def test_unknown_setup_is_refused_with_the_nearest():
    with pytest.raises(LookupError, match="unknown setup 'fanka'; did you mean 'franka'"):
        setups.load("fanka")
