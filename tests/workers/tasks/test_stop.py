"""Early stops: what the guard says, and what becomes of the episode."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from workers import setups
from workers.environments.environment import Observed
from workers.gymnasium_environment import SetupEnvironment
from workers.randomness import Stream, generator
from workers.rollout import random_episode, rollout
from workers.tasks.stop import LOW, OFF_WALKWAY, OUTSIDE, TILTED, HandGuard, WalkGuard, never
from workers.tasks.walk import Walk

GUARD = HandGuard(x=(0.1, 0.8), y=(-0.5, 0.5), lowest=0.09)
AT = 100  # control step


def _seen(*, hand: tuple[float, ...], contact: bool) -> Observed:
    signals = {"hand_position": np.array(hand)[:, None], "table_contact": np.array([contact])}
    return Observed(np.zeros((25, 1), dtype=np.float32), signals)


@pytest.mark.parametrize(
    ("hand", "contact", "reason"),
    [
        ((0.5, 0.0, 0.2), False, ""),
        ((0.1, 0.5, 0.0901), False, ""),
        ((0.09, 0.0, 0.2), False, OUTSIDE),
        ((0.81, 0.0, 0.2), False, OUTSIDE),
        ((0.5, -0.51, 0.2), False, OUTSIDE),
        ((0.5, 0.51, 0.2), False, OUTSIDE),
        ((0.5, 0.0, 0.09), False, LOW),
        ((0.5, 0.0, 0.2), True, LOW),
        ((float("nan"), 0.0, 0.2), False, OUTSIDE),
    ],
)
def test_the_guard_stops_a_hand_outside_or_near_the_table(hand, contact, reason):
    assert GUARD(_seen(hand=hand, contact=contact)) == reason


def test_a_guard_of_nothing_is_refused():
    with pytest.raises(ValueError, match=r"x must satisfy low < high, got \(0.8, 0.1\)"):
        HandGuard(x=(0.8, 0.1), y=(-0.5, 0.5), lowest=0.09)


@pytest.fixture(scope="module")
def setup():
    return replace(setups.load("yumi-rehearsal"), horizon=400)


@pytest.fixture(scope="module")
def pairs(setup):
    """Episodes with and without the rule."""
    free = replace(setup, stop=never)
    with setup.open() as environment:
        return [
            (random_episode(setup, environment, 0, index), random_episode(free, environment, 0, index))
            for index in range(8)
        ]


def test_a_stopped_episode_is_the_unstopped_one_up_to_there_and_then_stands_still(setup, pairs):
    stopped = [(episode, free) for episode, free in pairs if episode.stop]
    assert 0 < len(stopped) < len(pairs)
    for episode, free in stopped:
        still = np.all(episode.xi == episode.xi[:, -1:], axis=0)
        run = int(np.flatnonzero(~still)[-1]) + 2  # steps, that of the reason included
        assert np.array_equal(episode.xi[:, :run], free.xi[:, :run])
        assert not np.array_equal(episode.xi, free.xi)
        assert np.array_equal(episode.bad[: run - 1], free.bad[: run - 1])
        assert episode.bad[run - 1] == free.bad[run - 1] | 0b10000
        assert np.all(episode.bad[run:] == 0b10000)
        assert episode.y == (np.count_nonzero(free.bad[: run - 1]) + setup.horizon - run + 1) / setup.horizon


def test_it_is_worth_two_fallen_objects_and_names_its_reason(pairs):
    for episode, _ in pairs:
        if episode.stop:
            assert episode.stop in (LOW, OUTSIDE)
            assert episode.f == np.float32(-2 * 0.95)


def test_an_episode_that_gives_no_reason_is_untouched_by_the_rule(pairs):
    for episode, free in pairs:
        assert free.stop == ""
        if not episode.stop:
            assert np.array_equal(episode.xi, free.xi)
            assert (episode.f, episode.y) == (free.f, free.y)


def test_an_episode_stopped_at_once_has_all_its_steps(setup):
    hasty = replace(setup, stop=lambda observed: f"saw {observed.xi.shape[1]} step")
    with hasty.open() as environment:
        episode = random_episode(hasty, environment, 0, 0)
    assert episode.stop == "saw 1 step"
    assert episode.xi.shape == (25, setup.horizon)
    assert np.all(episode.xi == episode.xi[:, :1])


def test_a_rule_that_waits_stops_at_its_step(setup):
    seen = []
    waiting = replace(
        setup, stop=lambda observed: "enough" if seen.append(observed) or len(seen) > AT else ""
    )
    with waiting.open() as environment:
        episode = random_episode(waiting, environment, 0, 0)
    assert len(seen) == AT + 1
    assert np.all(episode.xi[:, AT:] == episode.xi[:, AT : AT + 1])
    assert not np.array_equal(episode.xi[:, AT - 1], episode.xi[:, AT])


def test_gymnasium_terminates_where_a_rollout_stops_with_the_same_objective(setup, pairs):
    index = next(index for index, (episode, _) in enumerate(pairs) if episode.stop)
    expected, _ = pairs[index]
    adapter = SetupEnvironment(setup)
    adapter.reset(seed=0)
    x = generator(0, Stream.CONTROLLER, index).random(setup.dimensions, dtype=np.float32)
    adapter._environment.reset(expected.physics)
    command = setup.controller.start(x, adapter._environment, setup.horizon)
    for step in range(setup.horizon):
        _, reward, terminated, truncated, info = adapter.step(np.array(command(step)))
        if terminated or truncated:
            break
        assert reward == 0.0
    adapter.close()
    assert terminated
    assert not truncated
    assert (reward, info["stop"]) == (pytest.approx(expected.f), expected.stop)


def _body(x: float = 0.0, euler: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Observed:
    """A walking robot in its last step, after a first one in which all was well."""
    xi = np.zeros((27, 2), dtype=np.float32)
    axes = Rotation.from_euler("xyz", euler, degrees=True).as_matrix()[:, :2].T.ravel()
    xi[18], xi[21:, 0], xi[21:, 1] = (0.0, x), (1, 0, 0, 0, 1, 0), axes
    return Observed(xi, {})


@pytest.mark.parametrize(
    ("seen", "reason"),
    [
        (_body(), ""),
        (_body(0.49, (59, 0, 120)), ""),
        (_body(-0.49, (0, -59, 0)), ""),
        (_body(0.51), OFF_WALKWAY),
        (_body(-0.51), OFF_WALKWAY),
        (_body(float("nan")), OFF_WALKWAY),
        (_body(0.0, (61, 0, 0)), TILTED),
        (_body(0.0, (0, -61, 0)), TILTED),
        (_body(0.9, (180, 0, 0)), TILTED),
    ],
)
def test_the_walk_guard_stops_a_robot_that_leaves_the_walkway_or_falls(seen, reason):
    """More than 0.5 m from the middle, or more than 60° of roll or pitch."""
    assert WalkGuard(Walk(channel=18))(seen) == reason


def test_a_stopped_walk_is_worth_what_was_walked_up_to_there():
    """No fast step is counted after the stop, though the last one was fast."""
    setup = setups.load("daisy-11d-rehearsal")
    observed = _body()
    observed.xi[19] = (1.0, 2.0)
    speeds = np.zeros((18, 2))
    speeds[3] = 11.0
    signals = {"joint_speeds": speeds, "elbow_contact": np.zeros(2, dtype=bool)}
    stopped = Observed(observed.xi, signals)
    assert setup.task.stopped_objective(stopped, setup.task.is_bad(stopped)) == pytest.approx(10 * 2.0 - 2)


def test_daisy_stops_where_its_unstopped_walk_first_leaves_the_walkway_or_falls():
    setup = setups.load("daisy-11d-rehearsal")
    x = generator(0, Stream.CONTROLLER, 1).random(setup.dimensions, dtype=np.float32)
    physics = {name: (low + high) / 2 for name, (low, high) in setup.physics.intervals.items()}
    with setup.open() as environment:
        episode = rollout(setup, environment, x, physics)
        free = rollout(replace(setup, stop=never), environment, x, physics)
    tilt, corridor = (1 << setup.conditions.index(name) for name in ("tilt", "corridor"))
    first = int(np.flatnonzero(free.bad & (tilt | corridor))[0])
    assert episode.stop in (OFF_WALKWAY, TILTED)
    assert np.array_equal(episode.xi[:, : first + 1], free.xi[:, : first + 1])
    assert np.all(episode.xi[:, first:] == episode.xi[:, first : first + 1])
    fast = np.count_nonzero(free.bad[: first + 1] & 1)
    assert episode.f == pytest.approx(10 * free.xi[19, first] - fast, abs=1e-5)
    assert episode.y == pytest.approx((np.count_nonzero(free.bad[:first]) + setup.horizon - first) / 1500)
