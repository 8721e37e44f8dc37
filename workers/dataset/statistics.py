"""What the episodes of a dataset are like: objective, badness, and how often each condition is bad."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from workers.dataset.folder import Dataset
from workers.dataset.schema import Bad
from workers.episode import DIVERGED, FAILED, UNUSABLE

MARKS = (0.0, 0.05, 0.25, 0.5, 0.75, 0.95, 1.0)
"""These quantiles describe the objective."""


@dataclass(frozen=True)
class Statistics:
    """Every episode counts alike, in whatever file it is; the diverged and failed ones count as entirely bad.

    Attributes:
        objective: quantiles of f at `MARKS`.
        badness: mean y, in [0, 1].
        bad_steps: the share of steps in which each condition was bad, or the mean degree, by its name.
        diverged: how many episodes diverged.
        failed: how many episodes raised, hung or ended their process.
        stopped: how many episodes a stop rule ended, by its reason, in the order of the alphabet.
    """

    objective: Float64[np.ndarray, " marks"]
    badness: float
    bad_steps: Mapping[str, float]
    diverged: int
    failed: int
    stopped: Mapping[str, int]


def statistics(dataset: Dataset) -> Statistics:
    """Describe the episodes of a dataset, without reading their trajectories.

    Raises:
        ValueError: the dataset has no episodes, or a file that is damaged or not its own.
    """
    objectives, badness, steps, stops = [], 0.0, 0, Counter[str]()
    bad = np.zeros(len(dataset.identity.conditions))
    for shard in dataset.shards():
        outcomes = dataset.outcomes(shard)
        objectives.append(outcomes.f)
        badness += float(outcomes.y.sum(dtype=np.float64))
        stops.update(outcomes.stop)
        bad += bad_steps(outcomes.bad, len(bad)).sum(axis=0)
        steps += outcomes.bad.size
    if not objectives:
        raise ValueError(f"{dataset.folder} holds no episodes yet; collect some first")
    f = np.concatenate(objectives).astype(np.float64)
    return Statistics(
        objective=np.quantile(f, MARKS),
        badness=badness / len(f),
        bad_steps=dict(zip(dataset.identity.conditions, (bad / steps).tolist(), strict=True)),
        diverged=stops[DIVERGED],
        failed=stops[FAILED],
        stopped={reason: stops[reason] for reason in sorted(stops.keys() - UNUSABLE - {""})},
    )


def bad_steps(bad: Bad, conditions: int) -> Float64[np.ndarray, "n conditions"]:
    """Count the bad steps of every condition in each episode; of a graded G_bad, add up its degrees.

    Args:
        bad: bits of the conditions or degrees, [n, T].
        conditions: how many there are; degrees always have one.

    Returns:
        Steps, [n, conditions], from 0 to T.
    """
    if bad.dtype == np.float32:
        return bad.sum(axis=1, keepdims=True, dtype=np.float64)
    return (bad[..., None] >> np.arange(conditions, dtype=np.uint8) & 1).sum(axis=1, dtype=np.float64)
