"""Choosing among the controllers of a dataset by how they fared."""

from enum import StrEnum

import numpy as np
from jaxtyping import Float32

from workers.dataset.folder import Dataset
from workers.episode import UNUSABLE


class Keep(StrEnum):
    """Which controllers of a dataset are kept."""

    BEST = "best"
    LEAST_BAD = "least-bad"


def chosen_controllers(dataset: Dataset, keep: Keep, count: int) -> Float32[np.ndarray, "c d"]:
    """Choose controllers by the means of their episodes; equal ones keep their order.

    Args:
        dataset: whose controllers.
        keep: which of them; those with an episode that diverged or failed come last.
        count: how many; fewer where there are fewer.

    Returns:
        The controllers, the first first, [c, D].

    Raises:
        ValueError: it holds no episodes, or a file is damaged.
    """
    x, scores = [], []
    repeats = dataset.identity.repeats
    draws, dimensions = dataset.draws(), len(dataset.identity.parameters)
    for shard in dataset.disjoint():
        outcomes = dataset.outcomes(shard)
        usable = np.array([stop not in UNUSABLE for stop in outcomes.stop])
        score = outcomes.f if keep is Keep.BEST else -outcomes.y
        scores.append(np.where(usable, score, -np.inf))
        x.append(outcomes.episode // repeats)
    if not x:
        raise ValueError("it holds no episodes")
    numbers, mean = _means(np.concatenate(x), np.concatenate(scores))
    first = numbers[np.argsort(-mean, kind="stable")[:count]]
    return np.stack([draws.controller(dimensions, int(number) * repeats) for number in first])


def _means(numbers: np.ndarray, scores: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    unique, place = np.unique(numbers, return_inverse=True)
    return unique, np.bincount(place, scores) / np.bincount(place)
