"""The same controllers in two simulations."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np

from workers.attempts import SafeRollouts
from workers.dataset.statistics import bad_steps
from workers.episode import Episode
from workers.isolation import IsolatedAttempts
from workers.physics import Physics
from workers.randomness import Stream, generator
from workers.rollout import draw, storable
from workers.setups import Setup

SAME = "same"
"""The other simulation has the physics of the one, episode by episode."""


@dataclass(frozen=True)
class Twins:
    """An episode of each simulation, of one controller.

    Attributes:
        one: of the first.
        other: of the second.
    """

    one: Episode
    other: Episode


def require_comparable(one: Setup, other: Setup, gap: str) -> None:
    """Refuse setups that cannot run the same controllers, or no such physics.

    Args:
        one: the first.
        other: the second.
        gap: as `twins` takes it.

    Raises:
        ValueError: the parameters of their controllers differ, or those of their physics with `gap` "same";
            the message names one that does.
        LookupError: the other has no such gap.
    """
    own, others = ({each.name: each for each in setup.controller.parameters} for setup in (one, other))
    if list(own.values()) != list(others.values()):
        odd = next((name for name in [*own, *others] if own.get(name) != others.get(name)), "their order")
        raise ValueError(
            f"{one.name} and {other.name} cannot run the same controllers: their parameters differ in {odd} "
            f"({_place(own, odd)} and {_place(others, odd)})"
        )
    is_relative = gap == SAME or _share(gap) is not None
    odd_physics = sorted(one.physics.intervals.keys() ^ other.physics.intervals.keys())
    if odd_physics and is_relative:
        raise ValueError(
            f"{one.name} and {other.name} cannot have the same physics: {odd_physics[0]} is a parameter of "
            "one of them only; name a gap of the second"
        )
    if not is_relative:
        other.gap(gap)


def twins(
    one: Setup,
    other: Setup,
    seed: int,
    count: int,
    gap: str = SAME,
    attempts: Callable[[Setup], SafeRollouts] = IsolatedAttempts,
) -> Iterator[Twins]:
    """Roll out random controllers in two simulations, side by side.

    Args:
        one: the first; its physics are those of a dataset of that seed.
        other: the second.
        seed: of controllers and physics.
        count: how many controllers.
        gap: physics of the second: `SAME`; a gap level of it, or ranges written out, drawn independently of
            the first's; or a share such as 1e-6, by which each parameter is larger than the first's.
        attempts: rolls them out; users' code may hang.

    Yields:
        The episodes of each controller, in the order of their indices.
    """
    with ThreadPoolExecutor(2) as pool, attempts(one) as first, attempts(other) as second:
        for index in range(count):
            x, physics = draw(one, seed, index)
            left = pool.submit(first.rollout, x, physics)
            right = pool.submit(second.rollout, x, _physics_there(other, gap, seed, index, physics))
            yield Twins(storable(one, left.result()), storable(other, right.result()))


def outcomes(setup: Setup, episodes: Sequence[Episode]) -> dict[str, Any]:
    """Put together what episodes of a setup came to.

    Args:
        setup: of the episodes.
        episodes: at least one.

    Returns:
        Under `f` and `y` the objective and badness of each, [n]; under `bad`, by the name of each bad
        condition, the share of steps in which it held, or its mean degree, [n].
    """
    bad = bad_steps(np.stack([episode.bad for episode in episodes]), len(setup.conditions)) / setup.horizon
    return {
        "f": np.array([episode.f for episode in episodes]),
        "y": np.array([episode.y for episode in episodes]),
        "bad": dict(zip(setup.conditions, bad.T, strict=True)),
    }


def _physics_there(other: Setup, gap: str, seed: int, index: int, physics: Physics) -> Physics:
    """The physics of the second simulation, where the first has these."""
    if gap == SAME:
        return physics
    share = _share(gap)
    if share is not None:
        return {name: value * (1.0 + share) for name, value in physics.items()}
    return other.gap(gap).draw(generator(seed, Stream.OTHER_PHYSICS, index))


def _share(gap: str) -> float | None:
    try:
        return float(gap)
    except ValueError:
        return None


def _place(parameters: Mapping[str, object], name: str) -> object:
    return parameters.get(name, "none")
