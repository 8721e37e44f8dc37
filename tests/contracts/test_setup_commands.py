"""Every setup as a Gymnasium environment, and the commands of its controller."""

import warnings

import numpy as np
from gymnasium.utils.env_checker import check_env

from tests.contracts.steps import commands_of, nominal
from workers.episode import Episode
from workers.gymnasium_environment import SetupEnvironment
from workers.randomness import Stream, generator
from workers.rollout import rollout
from workers.tasks.stop import STOPPED


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
        commands = commands_of(setup, environment, x, info["physics"])
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


def test_commands_stay_within_the_action_channels_at_every_corner(setup, environment):
    rng = np.random.default_rng(0)
    corners = [np.zeros(setup.dimensions), np.ones(setup.dimensions)]
    corners += [rng.integers(0, 2, setup.dimensions) for _ in range(4)]
    low, high = (np.array([getattr(c, bound) for c in environment.action]) for bound in ("low", "high"))
    for corner in corners:
        commands = np.array(commands_of(setup, environment, corner.astype(np.float32), nominal(setup)))
        assert commands.shape == (setup.horizon, len(environment.action))
        assert np.all((low <= commands) & (commands <= high))
