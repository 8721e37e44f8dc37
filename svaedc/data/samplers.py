"""Which episodes each worker sees at each update: a pure function of (seed, stage, update)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from jaxtyping import Float32, Int64, Integer

STRATA: Final = 10
"""Balanced sampling shows so many bins of equal width equally often."""

Order = Callable[[int, np.random.Generator], Int64[np.ndarray, " count"]]
"""It returns the positions of one pass over that many episodes."""


@dataclass(frozen=True)
class WorkerRank:
    """This worker's place among the workers that train one model together.

    Attributes:
        rank: From 0.
        world: Number of workers.
    """

    rank: int
    world: int

    def __post_init__(self) -> None:
        """Refuse a place outside the workers."""
        if not 0 <= self.rank < self.world:
            raise ValueError(f"rank must lie in 0..world - 1, got rank {self.rank} of {self.world}")


ALONE = WorkerRank(rank=0, world=1)


def uniform(count: int, rng: np.random.Generator) -> Int64[np.ndarray, " count"]:
    """Show every episode once, in random order.

    Args:
        count: Episodes.
        rng: Draws the order.

    Returns:
        Positions from 0 to count - 1, [count].
    """
    return rng.permutation(count)


@dataclass(frozen=True)
class Balanced:
    """Order for skewed data: passes in which every stratum of a quantity is equally frequent.

    Strata are bins of equal width between the quantity's extremes; empty ones are left out. A pass is as long
    as a uniform one: a rare stratum's episodes come several times, as equally often as can be, and a common
    one's are a fresh draw without replacement. The stored dataset is not altered, and neither are held-out
    episodes, so that measures stay comparable.

    Attributes:
        values: The quantity (y or f) of each training episode.
    """

    values: Float32[np.ndarray, " episodes"]

    def __post_init__(self) -> None:
        """Refuse values that belong to no bin."""
        if not len(self.values) or not np.isfinite(self.values).all():
            raise ValueError(
                "balanced sampling needs finite values, got NaN, infinity or none; check the dataset"
            )

    def __call__(self, count: int, rng: np.random.Generator) -> Int64[np.ndarray, " count"]:
        """Positions of one pass.

        Raises:
            ValueError: `count` is not the number of the values.
        """
        if count != len(self.values):
            raise ValueError(
                f"balanced sampling of {count} episodes needs as many values, got {len(self.values)}; take "
                "those of the training episodes"
            )
        members = self._strata()
        quotas = np.full(len(members), count // len(members))
        quotas[rng.permutation(len(members))[: count % len(members)]] += 1
        drawn = [_repeat(each, int(quota), rng) for each, quota in zip(members, quotas, strict=True)]
        return rng.permutation(np.concatenate(drawn))

    def _strata(self) -> list[Int64[np.ndarray, " members"]]:
        edges = np.linspace(self.values.min(), self.values.max(), STRATA + 1)[1:-1]
        stratum = np.digitize(self.values, edges)
        return [np.flatnonzero(stratum == each) for each in np.unique(stratum)]


def _repeat(
    members: Int64[np.ndarray, " members"], count: int, rng: np.random.Generator
) -> Int64[np.ndarray, " count"]:
    """That many of the members, none twice before all came once."""
    passes = [rng.permutation(members) for _ in range(-(-count // len(members)))]
    return np.concatenate([members[:0], *passes])[:count]


def batches(
    count: int,
    batch_size: int,
    shard: WorkerRank,
    seed: tuple[int, ...],
    updates: range,
    order: Order = uniform,
) -> Iterator[Integer[np.ndarray, " batch"]]:
    """Positions of this worker's share of the batch at each of `updates`.

    Passes over all episodes in a random order follow each other; the remainder that fills no batch is left
    out of its pass. Every worker gets the same number of batches of the same size, so that none waits for
    another.

    Args:
        count: Episodes.
        batch_size: Over all workers together; rounded up to a multiple of their number.
        shard: This worker.
        seed: Determines the permutations, one per pass.
        updates: Update numbers, from 0 at the stage's start.
        order: Of a pass, drawn anew for each.

    Yields:
        Positions from 0 to count - 1, [batch], one array per update.

    Raises:
        ValueError: Fewer episodes than workers.
    """
    if count < shard.world:
        raise ValueError(f"{shard.world} workers need at least as many training episodes, got {count}")
    share = min(-(-batch_size // shard.world), count // shard.world)
    per_pass = count // (share * shard.world)
    number, positions = -1, np.empty(0, np.int64)
    for update in updates:
        if update // per_pass != number:
            number = update // per_pass
            positions = order(count, np.random.default_rng((*seed, number)))
        start = (update % per_pass * shard.world + shard.rank) * share
        yield positions[start : start + share]
