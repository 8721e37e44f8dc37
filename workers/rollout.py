"""The control loop, the only one in this project: one controller, one episode.

Example:
    >>> from workers.setups import load
    >>> setup = load("franka")
    >>> with setup.open() as environment:
    ...     episode = random_episode(setup, environment, seed=0, index=7)
    >>> episode.xi.shape, episode.y <= 1.0
    ((25, 500), True)
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float32, UInt8

from workers.controllers.controller import Command, unit_cube
from workers.draws import Draws
from workers.environments.environment import Channel, Environment, Observed, check_observed
from workers.episode import DIVERGED, FAILED, Episode, Failure, Stored, degrees
from workers.physics import Physics
from workers.setups import Setup
from workers.tasks.stop import STOPPED, never
from workers.tasks.task import Bad, check_bad

VERSION = 1
"""It is part of a dataset's identity: raise it whenever an episode's bytes change."""


def rollout(setup: Setup, environment: Environment, x: np.ndarray, physics: Physics) -> Episode:
    """Run controller x for the setup's horizon under the given physics.

    Args:
        setup: robot, controller and task.
        environment: the setup's, open.
        x: the controller, [D], in [0, 1].
        physics: a value for every parameter of the setup, by name.

    Returns:
        The record of T steps, however early it ended; f is not checked to be finite.

    Raises:
        ValueError: when x is not a vector of D numbers in [0, 1], physics names other parameters than the
            setup's, or the task gives bad steps that an episode cannot hold.
    """
    if physics.keys() != setup.physics.intervals.keys():
        odd = sorted(physics.keys() ^ setup.physics.intervals.keys())
        raise ValueError(
            f"physics must name the parameters of {setup.name}; missing or unknown: {', '.join(odd)}"
        )
    steps = Steps(setup, environment, x, physics)
    if setup.stop is never:
        return steps.run_through()
    while (command := steps.command()) is not None:
        steps.apply(command)
    return steps.episode()


class Steps:
    """An episode that runs command by command, in a loop that may look at each before it is applied.

    Args:
        setup: robot, controller and task.
        environment: the setup's, open; it is reset.
        x: the controller, [D], in [0, 1].
        physics: a value for every parameter of the setup, by name.

    Raises:
        ValueError: when x is not a vector of D numbers in [0, 1].
    """

    def __init__(self, setup: Setup, environment: Environment, x: np.ndarray, physics: Physics) -> None:
        self._setup, self._environment, self._physics = setup, environment, physics
        self._x = unit_cube(x, setup.dimensions)
        environment.reset(physics)
        self._command: Command = setup.controller.start(self._x, environment, setup.horizon)
        self._records: Any = []
        self._reason = ""

    def run_through(self) -> Episode:
        """All steps at once, as the environment runs them fastest; no rule stops them early."""
        self._records = self._environment.run_commands(self._command, self._setup.horizon)
        return self.episode()

    def command(self) -> Sequence[float] | None:
        """The command of the next step; None after the last, or once a rule has stopped the episode."""
        step = len(self._records)
        return None if self._reason or step == self._setup.horizon else self._command(step)

    def apply(self, command: Sequence[float]) -> None:
        """Make a step with a command."""
        self._records.append(self._environment.step(command))
        if self._setup.stop is not never:
            self._reason = self._setup.stop(self._environment.observed(self._records[-1:]))

    def observations(self) -> Observed:
        """What was seen of the steps so far; at least one was made."""
        records = self._records
        seen = self._environment.observed(records)
        return check_observed(seen, self._setup.observation, len(records), self._setup.name)

    def episode(self) -> Episode:
        """What the steps so far were worth; at least one was made."""
        return _episode(self._setup, self.observations(), self._reason, self._x, self._physics)


def draw(setup: Setup, seed: int, index: int, repeats: int = 1) -> tuple[Float32[np.ndarray, " d"], Physics]:
    """Draw what is rolled out as episode `index` of a dataset; it depends on nothing else.

    Args:
        setup: robot, controller and task.
        seed: of the dataset.
        index: of the episode.
        repeats: how many consecutive episodes share a controller; each has physics of its own.

    Returns:
        The controller, [D], in [0, 1], and the physics.
    """
    return Draws(seed, repeats).episode(setup, index)


def random_episode(
    setup: Setup, environment: Environment, seed: int, index: int, repeats: int = 1
) -> Episode:
    """Episode `index` of a dataset with that seed: its controller and physics depend on nothing else.

    Args:
        setup: robot, controller and task.
        environment: the setup's, open.
        seed: of the dataset.
        index: of the episode.
        repeats: how many consecutive episodes share a controller; each has physics of its own.

    Returns:
        The episode. One whose objective is not finite has diverged: no dataset can hold that; a trial of
        Bayesian optimisation without one counts as failed.

    Raises:
        ValueError: as `rollout` does.
    """
    return storable(setup, rollout(setup, environment, *draw(setup, seed, index, repeats)))


def storable(setup: Setup, episode: Episode) -> Episode:
    """Make an episode one that a dataset can hold.

    Args:
        setup: robot, controller and task.
        episode: of the setup.

    Returns:
        The episode itself; the record of one that diverged where its objective is not finite.
    """
    if math.isfinite(episode.f):
        return episode
    return _worthless_episode(setup, episode.xi, episode.x, episode.physics, DIVERGED)


def failed_episode(setup: Setup, x: np.ndarray, physics: Physics, failure: Failure) -> Episode:
    """Make the record of an episode that came to no end; it shows the middle of every channel.

    Args:
        setup: robot, controller and task.
        x: the controller, [D], in [0, 1].
        physics: that it ran under.
        failure: what it failed of.

    Returns:
        The episode, bad throughout, with the lower limit of f.
    """
    nothing = np.empty((len(setup.observation), 0), np.float32)
    episode = _worthless_episode(setup, nothing, unit_cube(x, setup.dimensions), physics, FAILED)
    return replace(episode, failure=failure)


def _episode(setup: Setup, observed: Observed, reason: str, x: np.ndarray, physics: Physics) -> Episode:
    sane, steps = sane_steps(observed.xi, setup.observation), observed.xi.shape[1]
    if sane < steps:
        return _worthless_episode(setup, observed.xi[:, :sane], x, physics, DIVERGED)
    is_bad = setup.task.is_bad(observed)
    objective = setup.task.stopped_objective if reason else setup.task.objective
    stored = _encode_bad(check_bad(setup.task, is_bad, steps))
    bad = _mark_stopped(stored, setup) if reason else stored
    return Episode(
        x=x,
        xi=_hold_last(observed.xi, setup.horizon),
        bad=bad,
        y=float(degrees(bad).mean(dtype=np.float64)),
        f=float(np.float32(objective(observed, is_bad))),
        stop=reason,
        physics=physics,
    )


def _mark_stopped(bad: UInt8[np.ndarray, " run"] | Float32[np.ndarray, " run"], setup: Setup) -> Stored:
    """All T steps: `stopped` from the last that was run, and nothing else where none was; degrees of 1."""
    whole = np.zeros(setup.horizon, dtype=bad.dtype)
    whole[: len(bad)] = bad
    if setup.task.graded:
        whole[len(bad) - 1 :] = 1.0
    else:
        whole[len(bad) - 1 :] |= np.uint8(1 << setup.conditions.index(STOPPED))
    return whole


def _hold_last(xi: Float32[np.ndarray, "obs run"], horizon: int) -> Float32[np.ndarray, "obs time"]:
    """The trajectory with its last state repeated up to the horizon."""
    missing = horizon - xi.shape[1]
    return np.pad(xi, ((0, 0), (0, missing)), mode="edge") if missing else xi


def _worthless_episode(
    setup: Setup, sane: Float32[np.ndarray, "obs sane"], x: np.ndarray, physics: Physics, stop: str
) -> Episode:
    """The last sane state repeated, every step bad, f at its lower limit; never used to train a model."""
    if not sane.size:
        sane = np.array([[(channel.low + channel.high) / 2] for channel in setup.observation], np.float32)
    bad = _encode_bad(
        np.ones((len(setup.conditions), setup.horizon), np.float32 if setup.task.graded else bool)
    )
    return Episode(x, _hold_last(sane, setup.horizon), bad, 1.0, diverged_objective(setup), stop, physics)


def diverged_objective(setup: Setup) -> float:
    """The objective of an episode whose simulation exploded: the lower limit of f."""
    return float(np.float32(setup.objective_limits[0]))


def sane_steps(xi: Float32[np.ndarray, "obs time"], channels: tuple[Channel, ...]) -> int:
    """Count the steps before a channel leaves its bounds or is not a number: the simulation exploded.

    Args:
        xi: the trajectory, [obs, T].
        channels: of its rows, in order.

    Returns:
        From 0 to T, which means that it never did.
    """
    slack = 1e-5  # float32 rotation matrices
    low = np.array([channel.low for channel in channels], dtype=np.float32)[:, None] - slack
    high = np.array([channel.high for channel in channels], dtype=np.float32)[:, None] + slack
    insane = np.flatnonzero(~(np.isfinite(xi) & (xi >= low) & (xi <= high)).all(axis=0))
    return int(insane[0]) if insane.size else xi.shape[1]


def _encode_bad(is_bad: Bad) -> Stored:
    """Degrees as they are; otherwise one bit per condition, the first condition lowest."""
    return is_bad[0] if is_bad.dtype == np.float32 else np.packbits(is_bad, axis=0, bitorder="little")[0]
