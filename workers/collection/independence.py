"""Whether an episode depends on those before it; it must not, or a dataset is not what its seed says."""

from collections.abc import Sequence

import numpy as np

from workers.attempts import Attempts
from workers.rollout import UNUSABLE, Episode, draw, storable
from workers.setups import Setup


def order_dependence(setup: Setup, seed: int, repeats: int, start: int, episodes: Sequence[Episode]) -> str:
    """Roll out the last of some episodes alone in a fresh environment, then the first after it, and compare.

    Args:
        setup: robot, controller and task.
        seed: of the dataset.
        repeats: episodes of each controller.
        start: index of the first episode.
        episodes: as they were one after the other; those that diverged or failed are not tried.

    Returns:
        What differs, in a sentence with the remedy; "" where nothing does.
    """
    last = start + len(episodes) - 1
    chosen = {index: episodes[index - start] for index in (last, start)}
    kept = {index: episode for index, episode in chosen.items() if episode.stop not in UNUSABLE}
    with Attempts(setup) as attempts:
        again = attempts.rollouts(draw(setup, seed, index, repeats) for index in kept)
    for (index, episode), other in zip(kept.items(), again, strict=True):
        told = difference(episode, storable(setup, other))
        if told:
            return f"episode {index} is another one when it is rolled out in another order: {told}. {REMEDY}"
    return ""


REMEDY = (
    "reset() must bring back everything that an episode changes, and nothing may depend on the time of day "
    "or on random numbers but those of the given physics"
)
"""It stands behind every difference between two episodes that must be the same."""


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
