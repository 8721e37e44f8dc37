"""Any environment of Gymnasium as a setup, with the channels, the controller and the G_bad that one gives it.

Example:
    >>> from functools import partial
    >>> from workers.controllers.waypoints import Waypoints
    >>> torque = (Channel("torque", "N·m", -2.0, 2.0),)
    >>> setup = gymnasium_setup(
    ...     partial(gymnasium.make, "Pendulum-v1", disable_env_checker=True),
    ...     action=torque,
    ...     controller=Waypoints(torque, count=10),
    ...     bad={"hangs": lambda observed: observed.xi[0] < 0.0},
    ...     horizon=200,
    ...     objective_limits=(-1600.0, 0.0),
    ...     success=-400.0,
    ... )
    >>> setup.name, setup.control_step, [channel.name for channel in setup.observation]
    ('Pendulum-v1', 0.05, ['observation1', 'observation2', 'observation3'])
"""

import math
from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

from workers.controllers.controller import Controller
from workers.environments.environment import Channel, Observed
from workers.environments.gymnasium_bounds import bounded_channels
from workers.environments.gymnasium_world import (
    START,
    Apply,
    GymnasiumWorld,
    Make,
    Renew,
    World,
    action_box,
    make_anew,
    name_of,
    nothing_to_apply,
    packages_of,
    require_channels,
)
from workers.physics import PhysicsRanges
from workers.setups.setup import Setup
from workers.simulation.artist import Artist
from workers.simulation.scenery import Scenery
from workers.tasks.task import Bad, Task
from workers.user_code import UserCodeError

Condition = Callable[[Observed], np.ndarray]
"""It leads from an episode to one boolean per step: whether the condition holds, [T]."""
Worth = Callable[[Observed, Bad], float]
"""It leads from an episode, and which of its steps are bad, to f."""


def has_terminated(observed: Observed) -> np.ndarray:
    """Condition: the environment has terminated; it holds from that step to the horizon."""
    return observed.signals["terminated"]


def was_truncated(observed: Observed) -> np.ndarray:
    """Condition: the environment has truncated the episode; it holds from that step to the horizon."""
    return observed.signals["truncated"]


def total_reward(observed: Observed, bad: Bad) -> float:  # noqa: ARG001
    """Sum the rewards of all steps; those after the end have none.

    Args:
        observed: all steps of the episode.
        bad: not looked at.

    Returns:
        f.
    """
    return float(observed.signals["reward"].sum())


class GymnasiumTask(Task):
    """Bad conditions and an objective by functions.

    Args:
        bad: conditions by name, at least one.
        objective: f.
    """

    def __init__(self, bad: Mapping[str, Condition], objective: Worth) -> None:
        if not bad:
            raise UserCodeError(
                'bad must name at least one condition, got none; bad={"fell": has_terminated} is one that '
                "workers.gymnasium_setup offers"
            )
        self.conditions = tuple(bad)
        self._bad = dict(bad)
        self._objective = objective

    def is_bad(self, observed: Observed) -> Bad:
        """One row per condition."""
        return np.stack([_holds(name, condition, observed) for name, condition in self._bad.items()])

    def objective(self, observed: Observed, bad: Bad) -> float:
        """Value an episode by the function.

        Args:
            observed: all steps of the episode.
            bad: what `is_bad` says of them.

        Returns:
            f.
        """
        return float(self._objective(observed, bad))


def _holds(name: str, condition: Condition, observed: Observed) -> np.ndarray:
    row, steps = np.asarray(condition(observed)), observed.xi.shape[1]
    if row.shape != (steps,) or row.dtype != np.bool_:
        raise UserCodeError(
            f"the bad condition {name!r} must return one boolean per step, bool of shape ({steps},), got "
            f"{row.dtype} of shape {row.shape}"
        )
    return row


def gymnasium_setup(
    make: Make,
    *,
    action: Sequence[Channel],
    controller: Controller,
    bad: Mapping[str, Condition],
    horizon: int,
    objective_limits: tuple[float, float],
    success: float,
    observation: Sequence[Channel] = (),
    objective: Worth = total_reward,
    info: Sequence[str] = (),
    physics: PhysicsRanges | None = None,
    gaps: Mapping[str, PhysicsRanges] | None = None,
    apply: Apply = nothing_to_apply,
    renew: Renew = make_anew,
    control_step: float | None = None,
    scenery: Scenery | Artist | None = None,
) -> Setup:
    """Make a setup of an environment that Gymnasium makes, and of what Gymnasium does not know.

    Args:
        make: makes the environment; `functools.partial(gymnasium.make, "Hopper-v5")` for one.
        action: name, unit and finite bounds of each number of an action.
        controller: gives one command, a value for each channel of `action`, in every step.
        bad: G_bad: named conditions; `has_terminated` is one.
        horizon: T, control steps of an episode.
        objective_limits: the objectives that BO sees as 0 and 1.
        success: an episode with f above this succeeded.
        observation: name, unit and finite bounds of each number of an observation, in the order of
            `gymnasium.spaces.flatten`; none takes the bounds of the environment where it has some.
        objective: f; the sum of all rewards unless given.
        info: names of numbers in Gymnasium's `info` that conditions or f need, as signals.
        physics: ranges of data collection; None for none.
        gaps: gap levels; `paper`, `training` and `wide` are the ranges of data collection unless given.
        apply: puts the physics of an episode into the environment before it is reset.
        renew: what becomes of the environment after an episode, `make_anew` or `keep`.
        control_step: s of one step; None takes the `dt` of the environment.
        scenery: what pictures show; None where there is nothing to see.

    Returns:
        The setup, named after the environment.

    Raises:
        UserCodeError: the environment and what is said of it do not go together; the message tells how to.
    """
    ranges = PhysicsRanges({}) if physics is None else physics
    _require_effect(ranges, apply)
    world = make()
    try:
        name = name_of(world)
        _require_within(world, action)
        seconds = _control_step(world) if control_step is None else control_step
        _require_time(world, horizon)
        channels = bounded_channels(world, observation, action, horizon)
        packages = packages_of(world)
    finally:
        world.close()
    return Setup(
        name=name,
        build=partial(
            GymnasiumWorld,
            make,
            observation=channels,
            action=action,
            control_step=seconds,
            info=info,
            apply=apply,
            renew=renew,
            scenery=scenery,
        ),
        controller=controller,
        task=GymnasiumTask(bad, objective),
        observation=channels,
        horizon=horizon,
        control_step=seconds,
        physics=ranges,
        gaps={**dict.fromkeys(("paper", "training", "wide"), ranges), **(gaps or {})},
        objective_limits=objective_limits,
        success=success,
        packages=packages,
    )


def _require_within(world: World, action: Sequence[Channel]) -> None:
    """Refuse commands that the environment does not take; 0.7 is within a float32's 0.7."""
    box = action_box(world)
    require_channels(world, "action", action, math.prod(box.shape))
    for channel, low, high in zip(action, box.low.flat, box.high.flat, strict=True):
        least, most = box.dtype.type(channel.low), box.dtype.type(channel.high)
        if not (low <= least and most <= high):
            raise UserCodeError(
                f"bounds of the command {channel.name} must lie within [{low:g}, {high:g}], those of "
                f"{name_of(world)}, got [{channel.low:g}, {channel.high:g}]"
            )


def _require_effect(ranges: PhysicsRanges, apply: Apply) -> None:
    idle = sorted(ranges.intervals.keys() - {START})
    if idle and apply is nothing_to_apply:
        raise UserCodeError(
            f"physics has {', '.join(idle)}, and nothing puts that into the environment; give apply, a "
            "function of the environment and the physics of an episode"
        )


def _require_time(world: World, horizon: int) -> None:
    """Refuse a horizon that a time limit of the environment cuts short."""
    limit = world.spec.max_episode_steps if world.spec else None
    if limit is not None and horizon > limit:
        raise UserCodeError(
            f"horizon must be at most the {limit} steps after which {name_of(world)} truncates its episodes, "
            f"got {horizon}; make it with max_episode_steps={horizon}"
        )


def _control_step(world: World) -> float:
    step = getattr(world.unwrapped, "dt", None)
    if step is None:
        raise UserCodeError(f"{name_of(world)} does not say how long a step is; give control_step, in s")
    return float(step)
