"""A real environment of Gymnasium, small and with all the vices: it keeps what an episode left behind."""

from collections.abc import Sequence
from typing import ClassVar

import gymnasium
import numpy as np
from gymnasium import spaces

from workers.environments.environment import Channel

ACTION = (Channel("force", "N", -1.0, 1.0),)
OBSERVATION = (Channel("position", "m", -10.0, 10.0), Channel("speed", "m/s", -10.0, 10.0))


class Sled(gymnasium.Env):
    """Pushed by a force along a line; it terminates beyond `fence`. Its observation has no bounds.

    Each episode wears it: `wear` grows with every step and is never set back. Where it starts is drawn three
    times over, from its own generator and from those of its spaces.
    """

    metadata: ClassVar = {"render_modes": ["rgb_array"]}
    dt = 0.1

    def __init__(self, fence: float = 1.0, render_mode: str | None = None) -> None:
        self.fence = fence
        self.mass = 1.0
        self.wear = 0.0
        self.render_mode = render_mode
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32)
        self.observation_space = spaces.Box(-np.inf, np.inf, (2,), np.float64)
        self.state = np.zeros(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed, options=options)
        drawn = self.np_random.uniform() + self.action_space.sample()[0] + self.observation_space.sample()[0]
        self.state[:] = 0.01 * np.tanh(drawn), 0.0
        return self.state, {}

    def step(self, action):
        self.wear += 0.01
        self.state[1] += self.dt * action[0] / self.mass - self.dt * self.wear * self.state[1]
        self.state[0] += self.dt * self.state[1]
        terminated = bool(abs(self.state[0]) > self.fence)
        return self.state, -abs(float(action[0])), terminated, False, {"effort": float(action[0]) ** 2}

    def render(self):
        picture = np.zeros((20, 40, 3), dtype=np.uint8)
        picture[:, round(20 + 10 * self.state[0])] = 255
        return picture


def vary_mass(environment: gymnasium.Env, physics) -> None:
    """Scales what it finds, as `apply` should not."""
    environment.unwrapped.mass *= physics["mass"]


def pushes(force: float, steps: int) -> Sequence[list[float]]:
    return [[force]] * steps
