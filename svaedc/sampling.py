"""Which episodes each worker sees at each update: a pure function of (seed, stage, update)."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Integer


@dataclass(frozen=True)
class Shard:
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


ALONE = Shard(rank=0, world=1)


def batches(
    count: int, batch_size: int, shard: Shard, seed: tuple[int, ...], updates: range
) -> Iterator[Integer[np.ndarray, " batch"]]:
    """Positions of this worker's share of the batch at each of `updates`.

    Passes over a permutation of all episodes follow each other; the remainder that fills no batch is left out
    of its pass. Every worker gets the same number of batches of the same size, so that none waits for
    another.

    Args:
        count: Episodes.
        batch_size: Over all workers together; rounded up to a multiple of their number.
        shard: This worker.
        seed: Determines the permutations, one per pass.
        updates: Update numbers, from 0 at the stage's start.

    Raises:
        ValueError: Fewer episodes than workers.
    """
    if count < shard.world:
        raise ValueError(f"{shard.world} workers need at least as many training episodes, got {count}")
    share = min(-(-batch_size // shard.world), count // shard.world)
    per_pass = count // (share * shard.world)
    number, order = -1, np.empty(0, np.int64)
    for update in updates:
        if update // per_pass != number:
            number = update // per_pass
            order = np.random.default_rng((*seed, number)).permutation(count)
        start = (update % per_pass * shard.world + shard.rank) * share
        yield order[start : start + share]
