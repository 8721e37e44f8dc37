"""What every setup must obey, whatever its robot."""

import hashlib
import json
import os
import subprocess
import sys
import warnings
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from workers import setups
from workers.environments.environment import Observed
from workers.gymnasium_environment import SetupEnvironment
from workers.physics import PhysicsRanges
from workers.randomness import Stream, generator
from workers.rollout import Episode, random_episode, rollout
from workers.tasks.stop import STOPPED, never

EXAMPLE = str(Path(__file__).parents[2] / "examples" / "two_link_pusher")
SHORT = 300  # control steps; whole episodes run in the slow tests


@pytest.fixture(scope="module", params=[*sorted(setups.SETUPS), "two_link_pusher"])
def whole(request):
    """A setup that ships, or the example of a user's own, found as a user's would be."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLE)
        patch.setenv("PYTHONPATH", f"{EXAMPLE}{os.pathsep}{os.environ.get('PYTHONPATH', '')}")
        yield setups.load(request.param)


@pytest.fixture(scope="module")
def setup(whole):
    return replace(whole, horizon=min(whole.horizon, SHORT))


@pytest.fixture(scope="module")
def environment(setup):
    with setup.open() as opened:
        yield opened


@pytest.fixture(scope="module")
def episodes(setup, environment) -> list[Episode]:
    return [random_episode(setup, environment, 0, index) for index in range(6)]


def _bytes(episode: Episode) -> bytes:
    numbers = np.array([episode.y, episode.f])
    return b"".join(part.tobytes() for part in (episode.x, episode.xi, episode.bad, numbers))


def _nominal(setup) -> dict[str, float]:
    return {name: (low + high) / 2 for name, (low, high) in setup.physics.intervals.items()}


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


def test_different_controllers_move_differently(episodes):
    assert len({_bytes(episode) for episode in episodes}) == len(episodes)


REVEALING = {"yumi": (0, 19), "yumi-rehearsal": (0, 429), "two_link_pusher": (4,)}
"""Controllers that hit what they should: only a blow to both rolls of the YuMi shows restitution."""


def test_every_physics_parameter_changes_the_trajectory(setup, whole, environment):
    nominal = _nominal(setup)
    run = partial(rollout, whole if whole.name in REVEALING else setup, environment)
    controllers = [
        generator(0, Stream.CONTROLLER, index).random(setup.dimensions, dtype=np.float32)
        for index in REVEALING.get(setup.name, (0,))
    ]
    unchanged = [run(x, nominal).xi for x in controllers]
    for name, value in nominal.items():
        varied = nominal | {name: value * 1.05}
        differs = (
            not np.array_equal(run(x, varied).xi, xi) for x, xi in zip(controllers, unchanged, strict=True)
        )
        assert any(differs), f"{name} changes nothing"


def test_physics_with_an_unknown_or_missing_parameter_is_refused(setup, environment):
    x = np.full(setup.dimensions, 0.5)
    with pytest.raises(ValueError, match="gravity"):
        rollout(setup, environment, x, _nominal(setup) | {"gravity": 9.81})
    for name in _nominal(setup):
        with pytest.raises(ValueError, match=name):
            rollout(setup, environment, x, {k: v for k, v in _nominal(setup).items() if k != name})


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda x: np.append(x, 0.5), r"shape \(\d+,\)"),
        (lambda x: x[:-1], r"shape \(\d+,\)"),
        (lambda x: x.reshape(1, -1), r"shape \(\d+,\)"),
        (lambda x: np.where(np.arange(x.size) == 3, np.nan, x), r"x\[3\] is nan"),
        (lambda x: np.where(np.arange(x.size) == 2, 1.01, x), r"x\[2\] is 1.01"),
        (lambda x: np.where(np.arange(x.size) == 0, -0.01, x), r"x\[0\] is -0.01"),
        (lambda x: np.where(np.arange(x.size) == 1, np.inf, x), r"x\[1\] is inf"),
    ],
)
def test_controllers_outside_the_unit_cube_are_refused(setup, environment, spoil, message):
    with pytest.raises(ValueError, match=message):
        rollout(setup, environment, spoil(np.full(setup.dimensions, 0.5)), _nominal(setup))


def test_episodes_are_bit_identical_in_reverse_order_and_after_others(setup, environment, episodes):
    for index in reversed(range(len(episodes))):
        assert _bytes(random_episode(setup, environment, 0, index)) == _bytes(episodes[index])


def test_episodes_are_bit_identical_in_a_fresh_process(setup, episodes):
    script = (
        "import hashlib, json, sys\n"
        "from dataclasses import replace\n"
        "import numpy as np\n"
        "from workers import setups\n"
        "from workers.rollout import random_episode\n"
        "setup = replace(setups.load(sys.argv[1]), horizon=int(sys.argv[2]))\n"
        "with setup.open() as environment:\n"
        "    episodes = [random_episode(setup, environment, 0, index) for index in (4, 1)]\n"
        "digests = [hashlib.sha256(e.xi.tobytes() + e.bad.tobytes()).hexdigest() for e in episodes]\n"
        "print(json.dumps(digests))\n"
    )
    command = [sys.executable, "-c", script, setup.name, str(setup.horizon)]
    done = subprocess.run(command, capture_output=True, text=True, check=True, timeout=300)
    expected = [
        hashlib.sha256(episodes[index].xi.tobytes() + episodes[index].bad.tobytes()).hexdigest()
        for index in (4, 1)
    ]
    assert json.loads(done.stdout.splitlines()[-1]) == expected


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


def test_gymnasium_accepts_the_environment(setup):
    environment = SetupEnvironment(setup)
    with warnings.catch_warnings():
        # It warns of bounds beyond [-1, 1] and of an environment made without a registry.
        warnings.filterwarnings("ignore", message=".*(not normalized|symmetric|spec|normalize).*")
        check_env(environment, skip_render_check=True)
    environment.close()
    assert environment.action_space.shape == (len(environment.action_space.low),)


def test_gymnasium_steps_reproduce_a_rollout_bit_for_bit(setup):
    adapter = SetupEnvironment(setup)
    x = generator(0, Stream.CONTROLLER, 1).random(setup.dimensions, dtype=np.float32)
    _, info = adapter.reset(seed=7)
    with setup.open() as environment:
        expected = rollout(setup, environment, x, info["physics"])
        commands = _commands(setup, environment, x, info["physics"])
    run = _steps_run(setup, expected)
    seen = [adapter.step(command) for command in commands[:run]]
    adapter.close()
    observations, rewards, terminated, truncated, infos = zip(*seen, strict=True)
    assert np.array_equal(np.stack(observations, axis=1), expected.xi[:, :run])
    assert [info["bad"] for info in infos] == (expected.bad[:run] != 0).tolist()
    assert rewards[:-1] == (0.0,) * (run - 1)
    assert np.float32(rewards[-1]) == expected.f
    assert (terminated[-1], truncated[-1]) == (bool(expected.stop), not expected.stop)
    assert not any((*terminated[:-1], *truncated[:-1]))
    assert infos[-1].get("stop", "") == expected.stop


def _steps_run(setup, episode: Episode) -> int:
    """Steps up to the end of the episode, or to its stop."""
    if not episode.stop:
        return setup.horizon
    return 1 + int(np.flatnonzero(episode.bad >> setup.conditions.index(STOPPED) & 1)[0])


def _commands(setup, environment, x, physics) -> list[np.ndarray]:
    environment.reset(physics)
    command = setup.controller.start(x, environment, setup.horizon)
    issued = []
    for step in range(setup.horizon):
        issued.append(np.array(command(step)))
        environment.step(issued[-1].tolist())
    return issued


def test_commands_stay_within_the_action_channels_at_every_corner(setup, environment):
    rng = np.random.default_rng(0)
    corners = [np.zeros(setup.dimensions), np.ones(setup.dimensions)]
    corners += [rng.integers(0, 2, setup.dimensions) for _ in range(4)]
    low, high = (np.array([getattr(c, bound) for c in environment.action]) for bound in ("low", "high"))
    for corner in corners:
        commands = np.array(_commands(setup, environment, corner.astype(np.float32), _nominal(setup)))
        assert commands.shape == (setup.horizon, len(environment.action))
        assert np.all((low <= commands) & (commands <= high))


def test_unknown_setup_is_refused_with_the_nearest():
    with pytest.raises(LookupError, match="unknown setup 'fanka'; did you mean 'franka'"):
        setups.load("fanka")


@pytest.mark.parametrize("interval", [(0.2, 0.1), (-0.1, 0.1), (0.0, float("inf")), (float("nan"), 1.0)])
def test_impossible_physics_ranges_are_refused(interval):
    with pytest.raises(ValueError, match="physics range of mass"):
        PhysicsRanges({"mass": interval})
