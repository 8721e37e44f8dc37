"""Any setup as a Gymnasium environment, for people who bring their own controller."""

from collections.abc import Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from workers.environments.environment import Channel, Observed
from workers.setups import Setup


class SetupEnvironment(gymnasium.Env[np.ndarray, np.ndarray]):
    """The setup's environment, stepped exactly as in a rollout.

    | | |
    |---|---|
    | action | the setup's command channels, in their units, clipped to their bounds |
    | observation | ξ at this step: the setup's observation channels, in their units |
    | reward | 0 in every step but the last, where it is f of the whole episode |
    | start | the setup's start pose; physics drawn from the ranges of data collection |
    | end | truncated after the setup's horizon; terminated when the setup's stop rule has a reason |

    `info` holds `bad`, whether a bad condition holds, after `reset` the episode's `physics`, and when
    terminated the reason as `stop`.
    """

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._environment = setup.open()
        self._seen = _box(setup.observation)
        self._commands = _box(self._environment.action)
        self.observation_space = self._seen
        self.action_space = self._commands
        self._records: list[Any] = []

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode; `seed` decides its physics and that of the episodes after it."""
        super().reset(seed=seed, options=options)
        physics = self._setup.physics.draw(self.np_random)
        self._environment.reset(physics)
        self._records = []
        observed = self._environment.observed([self._environment.record()])
        return self._row(observed), {"physics": physics, "bad": bool(self._setup.task.is_bad(observed).any())}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Apply one command for one control step."""
        command: Sequence[float] = np.clip(action, self._commands.low, self._commands.high).tolist()
        self._records.append(self._environment.step(command))
        observed = self._environment.observed(self._records[-1:])
        reason = self._setup.stop(observed)
        truncated = not reason and len(self._records) >= self._setup.horizon
        info = {"bad": bool(self._setup.task.is_bad(observed).any())} | ({"stop": reason} if reason else {})
        reward = self._objective(reason) if reason or truncated else 0.0
        return self._row(observed), reward, bool(reason), truncated, info

    def close(self) -> None:
        """End the simulation."""
        self._environment.close()

    def _row(self, observed: Observed) -> np.ndarray:
        return np.clip(observed.xi[:, 0], self._seen.low, self._seen.high)

    def _objective(self, reason: str) -> float:
        task = self._setup.task
        whole = self._environment.observed(self._records)
        objective = task.stopped_objective if reason else task.objective
        return objective(whole, task.is_bad(whole))


def _box(channels: Sequence[Channel]) -> spaces.Box:
    low = np.array([channel.low for channel in channels], dtype=np.float32)
    high = np.array([channel.high for channel in channels], dtype=np.float32)
    return spaces.Box(low, high, dtype=np.float32)
