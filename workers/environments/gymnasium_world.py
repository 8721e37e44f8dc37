"""An environment that Gymnasium made, as one of ours: flat numbers, finite bounds, nothing left behind."""

import math
from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from jaxtyping import Float64

from workers.environments.environment import Channel, Environment, Observed
from workers.physics import Physics
from workers.simulation.artist import Artist
from workers.simulation.scenery import Scenery
from workers.user_code import UserCodeError

World = gymnasium.Env[Any, Any]
Make = Callable[[], World]
"""It makes the environment, as `functools.partial(gymnasium.make, "Hopper-v5")` does."""
Apply = Callable[[World, Physics], None]
"""It puts the physics of an episode into an environment, before that is reset."""
Renew = Callable[[Make, World], World]
"""It leads from the environment of the last episode to that of the next."""

START = "start"
"""A physics parameter of this name, rounded down, is the seed of Gymnasium's `reset`; without one it is 0."""


def make_anew(make: Make, used: World) -> World:
    """Close the environment and make another, so that nothing of an episode reaches the next.

    Args:
        make: makes it.
        used: of the last episode.

    Returns:
        The new one.
    """
    used.close()
    return make()


def keep(make: Make, used: World) -> World:  # noqa: ARG001
    """Go on with the same environment, where making one takes long.

    `apply` must then set every value that it ever changes, and not scale what it finds, and `reset` must set
    back all the rest.

    Args:
        make: not called.
        used: of the last episode.

    Returns:
        The same.
    """
    return used


def nothing_to_apply(environment: World, physics: Physics) -> None:
    """Of environments without physics parameters, but for `start`.

    Args:
        environment: not changed.
        physics: not looked at.
    """


class GymnasiumRecord(NamedTuple):
    """What an environment said after a step: its observation as flat numbers, and all else."""

    row: Float64[np.ndarray, " obs"]
    reward: float
    terminated: bool
    truncated: bool
    info: tuple[float, ...]


class GymnasiumWorld(Environment):
    """Steps an environment of Gymnasium; one that has ended is not stepped again.

    From its end on an episode repeats the last observation, with no reward. Signals, [T] each, are `reward`,
    `terminated` and `truncated`, which stay true from the end on, and the numbers of `info` that were asked
    for, NaN where a reset does not tell them.

    Args:
        make: makes the environment.
        observation: a channel for each number of its observation, in the order of `gymnasium.spaces.flatten`.
        action: a channel for each number of its action; commands are clipped to their bounds.
        control_step: s of one step.
        info: names of numbers in its `info` that are signals.
        apply: puts the physics into it.
        renew: `make_anew` or `keep`.
        scenery: what pictures show.

    Raises:
        UserCodeError: its spaces are no boxes, or there are more or fewer channels than numbers.
    """

    def __init__(
        self,
        make: Make,
        *,
        observation: Sequence[Channel],
        action: Sequence[Channel],
        control_step: float,
        info: Sequence[str] = (),
        apply: Apply = nothing_to_apply,
        renew: Renew = make_anew,
        scenery: Scenery | Artist | None = None,
    ) -> None:
        self.observation = tuple(observation)
        self.action = tuple(action)
        self.control_step = control_step
        self.scenery = scenery
        self._make = make
        self._info = tuple(info)
        self._apply = apply
        self._renew = renew
        self._low = np.array([channel.low for channel in action])
        self._high = np.array([channel.high for channel in action])
        self._world = make()
        self._box = action_box(self._world)
        require_channels(self._world, "action", self.action, math.prod(self._box.shape))
        require_channels(self._world, "observation", self.observation, math.prod(flat_box(self._world).shape))
        self._last = self._begin(0)

    def reset(self, physics: Physics) -> None:
        """Renew the environment, put the physics into it, and reset it with the seed of the start."""
        self._world = self._renew(self._make, self._world)
        _let_explode(self._world)
        self._apply(self._world, physics)
        self._last = self._begin(int(physics.get(START, 0)))

    def _begin(self, seed: int) -> GymnasiumRecord:
        """Reset with a seed for all that the environment may draw from."""
        for layer in _layers(self._world):
            layer.action_space.seed(seed)
            layer.observation_space.seed(seed)
        seen, info = self._world.reset(seed=seed)
        told = tuple(float(info.get(name, math.nan)) for name in self._info)
        return GymnasiumRecord(self._row(seen), reward=0.0, terminated=False, truncated=False, info=told)

    def step(self, command: Sequence[float]) -> GymnasiumRecord:
        """Apply one command; after the end, nothing happens any more."""
        if self._last.terminated or self._last.truncated:
            self._last = self._last._replace(reward=0.0)
            return self._last
        bounded = np.minimum(np.maximum(command, self._low), self._high)  # np.clip takes twice as long
        action = bounded.astype(self._box.dtype).reshape(self._box.shape)
        seen, reward, terminated, truncated, info = self._world.step(action)
        told = tuple(self._number(info, name) for name in self._info)
        self._last = GymnasiumRecord(self._row(seen), float(reward), bool(terminated), bool(truncated), told)
        return self._last

    def _number(self, info: dict[str, Any], name: str) -> float:
        if name not in info:
            raise UserCodeError(
                f"info of {name_of(self._world)} has no {name!r}; it has {', '.join(info) or 'nothing'}"
            )
        return float(info[name])

    def _row(self, seen: Any) -> Float64[np.ndarray, " obs"]:
        return flat_row(self._world, seen)

    def record(self) -> GymnasiumRecord:
        """What the environment said last."""
        return self._last

    def observed(self, records: Sequence[GymnasiumRecord]) -> Observed:
        """One row of ξ per number, and the signals."""
        rows, rewards, terminated, truncated, told = zip(*records, strict=True)
        with np.errstate(over="ignore"):  # such an episode has exploded
            xi = np.array(rows).astype(np.float32).T
        signals = {
            "reward": np.array(rewards),
            "terminated": np.array(terminated),
            "truncated": np.array(truncated),
        }
        return Observed(xi, signals | dict(zip(self._info, np.array(told).T, strict=True)))

    def close(self) -> None:
        """Close the environment."""
        self._world.close()


def _layers(world: World) -> Iterator[World]:
    """The environment and all that its wrappers hold; each may have spaces of its own to draw from."""
    while isinstance(world, gymnasium.Wrapper):
        yield world
        world = world.env
    yield world


def _let_explode(world: World) -> None:
    """MuJoCo sets a simulation that explodes back to its start and goes on: keep it from that."""
    if "mujoco" in packages_of(world):
        from workers.mujoco.explosions import keep_exploded

        keep_exploded(cast(Any, world.unwrapped).model)


def packages_of(world: World) -> tuple[str, ...]:
    """The packages whose versions decide what it does: Gymnasium, and the engine where that is MuJoCo."""
    model: Any = getattr(world.unwrapped, "model", None)
    is_mujoco = type(model).__module__.partition(".")[0] == "mujoco"
    return ("gymnasium", "mujoco") if is_mujoco else ("gymnasium",)


def name_of(world: World) -> str:
    """Its registered name, or that of its class."""
    return world.spec.id if world.spec else type(world.unwrapped).__name__


def action_box(world: World) -> spaces.Box:
    """The space of its actions; one that is no `Box` raises `UserCodeError`."""
    space = world.action_space
    if not isinstance(space, spaces.Box):
        raise UserCodeError(
            f"the action space of {name_of(world)} must be a Box of real numbers, got {space}; a controller "
            "gives numbers: wrap it with gymnasium.wrappers.TransformAction, or take a continuous variant"
        )
    return space


def flat_box(world: World) -> spaces.Box:
    """The space of its observations as flat numbers; one that is no `Box` then raises `UserCodeError`."""
    flat = spaces.flatten_space(world.observation_space)
    if not isinstance(flat, spaces.Box):
        raise UserCodeError(
            f"the observation space of {name_of(world)} must be a Box, or a Dict of boxes, got "
            f"{world.observation_space}; wrap it with gymnasium.wrappers.TransformObservation"
        )
    return flat


def flat_row(world: World, seen: Any) -> Float64[np.ndarray, " obs"]:
    """Copy an observation as flat numbers.

    Args:
        world: the environment.
        seen: its observation.

    Returns:
        One number for each place of `flat_box`.
    """
    return np.asarray(spaces.flatten(world.observation_space, seen), dtype=np.float64)


def require_channels(world: World, what: str, channels: Sequence[Channel], count: int) -> None:
    """Refuse more or fewer channels than there are numbers.

    Args:
        world: the environment, for the error.
        what: the channels are of, `action` or `observation`.
        channels: as they are given.
        count: of the numbers.

    Raises:
        UserCodeError: naming the channels.
    """
    if len(channels) != count:
        raise UserCodeError(
            f"{what} must have a channel for each of the {count} numbers of {name_of(world)}, got "
            f"{len(channels)}: {', '.join(channel.name for channel in channels)}"
        )
