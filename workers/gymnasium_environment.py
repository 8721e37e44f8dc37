"""Any setup as a Gymnasium environment, for people who bring their own controller."""

from collections.abc import Callable, Sequence
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from workers.environments.environment import Channel, Observed
from workers.episode import DIVERGED
from workers.rollout import diverged_objective, sane_steps
from workers.setups import Setup


class SetupEnvironment(gymnasium.Env[np.ndarray, np.ndarray]):
    """The setup's environment, stepped exactly as in a rollout.

    | | |
    |---|---|
    | action | the setup's command channels, in their units, clipped to their bounds |
    | observation | ξ at this step: the setup's observation channels, in their units |
    | reward | 0 in every step but the last, where it is f of the whole episode |
    | start | the setup's start pose; physics drawn from the ranges of data collection |
    | end | truncated after the setup's horizon; terminated by its stop rule or an explosion |

    An episode that explodes is bad, ends with its last sane observation and has f's lower limit for a reward,
    as in a rollout. A stopped one is bad in its last step and has the task's objective of a stopped episode.
    `info` holds `bad`, whether a bad condition holds or how bad the step is (G_bad sees that step alone),
    after `reset` the episode's `physics`, and when terminated the reason as `stop`.
    """

    def __init__(self, setup: Setup) -> None:
        self._setup = setup
        self._environment = setup.open()
        self._seen = _box(setup.observation)
        self._commands = _box(self._environment.action)
        self.observation_space = self._seen
        self.action_space = self._commands
        self._records: list[Any] = []
        self._last = self._seen.low

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[np.ndarray, dict[str, Any]]:
        """Start an episode.

        Args:
            seed: decides its physics and that of the episodes after it; None goes on with the last one.
            options: not looked at.

        Returns:
            The first observation, [obs], and `info` with `physics` and `bad`.
        """
        super().reset(seed=seed, options=options)
        physics = self._setup.physics.draw(self.np_random)
        self._environment.reset(physics)
        self._records = []
        observed = self._environment.observed([self._environment.record()])
        self._last = self._row(observed)
        return self._last, {"physics": physics, "bad": self._bad(observed)}

    def step(self, action: np.ndarray) -> tuple[np.ndarray, float, bool, bool, dict[str, Any]]:
        """Apply one command for one control step."""
        command: Sequence[float] = np.clip(action, self._commands.low, self._commands.high).tolist()
        record = self._environment.step(command)
        observed = self._environment.observed([record])
        if not sane_steps(observed.xi, self._setup.observation):
            return self._last, diverged_objective(self._setup), True, False, _end_info(DIVERGED)
        self._records.append(record)
        self._last = self._row(observed)
        reason = self._setup.stop(observed)
        if reason:
            reward = self._objective(self._setup.task.stopped_objective)
            return self._last, reward, True, False, _end_info(reason)
        truncated = len(self._records) >= self._setup.horizon
        reward = self._objective(self._setup.task.objective) if truncated else 0.0
        return self._last, reward, False, truncated, {"bad": self._bad(observed)}

    def close(self) -> None:
        """End the simulation."""
        self._environment.close()

    def _row(self, observed: Observed) -> np.ndarray:
        return np.clip(observed.xi[:, 0], self._seen.low, self._seen.high)

    def _bad(self, observed: Observed) -> bool | float:
        return self._setup.task.is_bad(observed).max().item()

    def _objective(self, of: Callable[[Observed, np.ndarray], float]) -> float:
        whole = self._environment.observed(self._records)
        return of(whole, self._setup.task.is_bad(whole))


def _end_info(reason: str) -> dict[str, Any]:
    """The `info` of a step that ended an episode before its horizon."""
    return {"bad": True, "stop": reason}


def _box(channels: Sequence[Channel]) -> spaces.Box:
    low = np.array([channel.low for channel in channels], dtype=np.float32)
    high = np.array([channel.high for channel in channels], dtype=np.float32)
    return spaces.Box(low, high, dtype=np.float32)
