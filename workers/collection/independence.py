"""Whether an episode depends on those before it; it must not, or a dataset is not what its seed says."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from workers.attempts import SafeRollouts
from workers.draws import Draws
from workers.episode import UNUSABLE, Episode
from workers.isolation import IsolatedAttempts
from workers.rollout import storable
from workers.setups import Setup

REMEDY = (
    "reset() must bring back everything that an episode changes, and nothing may depend on the time of day "
    "or on random numbers but those of the given physics"
)
"""It stands behind every difference between two episodes that must be the same."""


def order_dependence(
    setup: Setup,
    draws: Draws,
    start: int,
    episodes: Sequence[Episode],
    attempts: Callable[[Setup], SafeRollouts] = IsolatedAttempts,
) -> str:
    """Roll out the first and the last of some episodes anew, the one right after the other, and compare.

    Args:
        setup: robot, controller and task.
        draws: of the dataset.
        start: index of the first episode.
        episodes: as they were, all one after the other.
        attempts: rolls them out; users' code may hang in another order.

    Returns:
        What differs, in a sentence with the remedy; "" where nothing does.
    """
    before = dict(enumerate(episodes, start=start))
    with attempts(setup) as trying:
        return told_dependence(before, ends(setup, draws, before, trying))


def ends(
    setup: Setup, draws: Draws, episodes: Mapping[int, Episode], attempts: SafeRollouts
) -> dict[int, Episode]:
    """Roll out the first and the last of some episodes, the one right after the other.

    Args:
        setup: robot, controller and task.
        draws: of the dataset.
        episodes: by their index; those that diverged or failed are left out.
        attempts: rolls them out.

    Returns:
        The episodes by their index.
    """
    chosen = [index for index in dict.fromkeys((min(episodes), max(episodes)))]
    usable = [index for index in chosen if episodes[index].stop not in UNUSABLE]
    again = attempts.rollouts(draws.episode(setup, index) for index in usable)
    return {index: storable(setup, episode) for index, episode in zip(usable, again, strict=True)}


def told_dependence(episodes: Mapping[int, Episode], again: Mapping[int, Episode]) -> str:
    """Say what differs between episodes and the same ones in another order.

    Args:
        episodes: by their index, as they were first.
        again: some of them, as they were then.

    Returns:
        A sentence with the remedy, of the first that differs; "" where none does.
    """
    for index, other in again.items():
        told = difference(episodes[index], other)
        if told:
            return f"episode {index} is another one when it is rolled out in another order: {told}. {REMEDY}"
    return ""


def difference(one: Episode, other: Episode) -> str:
    """Compare two episodes of one controller under one physics.

    Args:
        one: as it was first.
        other: as it was then.

    Returns:
        By how much they differ; "" where they are the same.
    """
    if np.array_equal(one.xi, other.xi) and np.array_equal(one.bad, other.bad) and one.f == other.f:
        return ""
    largest = float(np.abs(one.xi - other.xi).max())
    return f"ξ differs by up to {largest:.3g}, f is {one.f:.6g} and {other.f:.6g}"
