"""The bounds of ξ of an environment of Gymnasium: its own, given ones, or else a proposal."""

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from jaxtyping import Float

from workers.environments.environment import Channel
from workers.environments.gymnasium_world import World, action_box, flat_box, flat_row, name_of
from workers.user_code import UserCodeError

EPISODES = 20
"""So many episodes of random commands show what observations are like."""


def bounded_channels(
    world: World, observation: Sequence[Channel], action: Sequence[Channel], horizon: int
) -> tuple[Channel, ...]:
    """Choose the channels of ξ, and refuse numbers without bounds.

    Args:
        world: the environment.
        observation: name, unit and bounds of each number of an observation; none takes those of its space.
        action: bounds of random commands, for a proposal.
        horizon: control steps of the episodes that a proposal looks at.

    Returns:
        One channel per number.

    Raises:
        UserCodeError: there are more or fewer channels than numbers, or bounds are not finite; the message
            proposes channels that go by what 20 episodes of random commands showed.
    """
    box = flat_box(world)
    given = [(each.name, each.unit, each.low, each.high) for each in observation]
    stated = given or _own_bounds(world.observation_space, box)
    count = math.prod(box.shape)
    if len(stated) != count:
        problem = (
            f"observation must have a channel for each of the {count} numbers of {name_of(world)}, got "
            f"{len(stated)}"
        )
        names = [(f"observation{number}", "") for number in range(1, count + 1)]
        names[: len(stated)] = [(name, unit) for name, unit, _, _ in stated[:count]]
    else:
        unbounded = [name for name, _, low, high in stated if not math.isfinite(high - low)]
        if not unbounded:
            return tuple(Channel(*each) for each in stated)
        problem = f"{name_of(world)} has no finite bounds of {', '.join(unbounded)}, and ξ needs some"
        names = [(name, unit) for name, unit, _, _ in stated]
    raise UserCodeError(f"{problem}; {_proposal(names, _extremes(world, action, horizon))}")


def _own_bounds(space: spaces.Space[Any], box: spaces.Box) -> list[tuple[str, str, float, float]]:
    """Name, unit and bounds of every number, as the space has them; units it has none."""
    parts = space.items() if isinstance(space, spaces.Dict) else [("observation", space)]
    names = [
        f"{key}{number}"
        for key, part in parts
        for number in range(1, 1 + math.prod(spaces.flatten_space(part).shape or (1,)))
    ]
    return [
        (name, "", low, high)
        for name, low, high in zip(names, box.low.tolist(), box.high.tolist(), strict=True)
    ]


def _proposal(names: Sequence[tuple[str, str]], seen: Float[np.ndarray, "2 n"]) -> str:
    """Channels to copy: as wide again to either side as what was seen."""
    lines = [
        f'    Channel("{name}", "{unit}", {low - span:.3g}, {high + span:.3g}),  # saw {low:.3g}, {high:.3g}'
        for (name, unit), low, high in zip(names, *seen.tolist(), strict=True)
        for span in (high - low or 1.0,)
    ]
    return (
        f"{EPISODES} episodes of random commands propose what is below: name the numbers, give them units, "
        "and widen their bounds where your controllers reach further, for an episode that leaves them counts "
        "as exploded\nobservation=(\n" + "\n".join(lines) + "\n)"
    )


def _extremes(world: World, action: Sequence[Channel], horizon: int) -> Float[np.ndarray, "2 n"]:
    """The least and the greatest of each number in episodes of random commands."""
    rows = np.array(list(_random_rows(world, action, horizon)))
    rows = rows[np.isfinite(rows).all(axis=1)]
    return np.stack([rows.min(axis=0), rows.max(axis=0)])


def _random_rows(world: World, action: Sequence[Channel], horizon: int) -> Iterator[np.ndarray]:
    rng = np.random.default_rng(0)
    low, high = ([getattr(channel, bound) for channel in action] for bound in ("low", "high"))
    commands = action_box(world)
    for seed in range(EPISODES):
        seen, _ = world.reset(seed=seed)
        yield flat_row(world, seen)
        for _ in range(horizon):
            command = rng.uniform(low, high).astype(commands.dtype).reshape(commands.shape)
            seen, _, terminated, truncated, _ = world.step(command)
            yield flat_row(world, seen)
            if terminated or truncated:
                break
