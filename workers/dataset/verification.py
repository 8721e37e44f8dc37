"""Proof that a dataset is whole: every byte, every index, every number that follows from others."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from workers.dataset import shards
from workers.dataset.folder import Dataset
from workers.dataset.schema import Columns, read_identity
from workers.dataset.shards import Shard
from workers.randomness import generator


@dataclass(frozen=True)
class Problem:
    """Something wrong with one file."""

    file: str
    what: str


def verify(dataset: Dataset) -> Iterator[tuple[Shard, list[Problem]]]:
    """Check every shard in turn, and yield it with what is wrong with it; nothing is changed or deleted."""
    reached = 0
    for shard in dataset.shards():
        problems = [] if shard.start >= reached else [Problem(shard.name, f"overlaps episodes below {reached}")]
        if shard.start > reached:
            problems.append(Problem(shard.name, f"episodes {reached} to {shard.start - 1} before it are missing"))
        reached = max(reached, shard.stop)
        yield shard, problems + _file_problems(dataset, shard)


def _file_problems(dataset: Dataset, shard: Shard) -> list[Problem]:
    try:
        return [Problem(shard.name, what) for what in (*_byte_problems(dataset, shard), *_row_problems(dataset, shard))]
    except ValueError as error:
        return [Problem(shard.name, str(error))]


def _byte_problems(dataset: Dataset, shard: Shard) -> Iterator[str]:
    recorded = shards.recorded_digest(dataset.folder, shard)
    if not recorded:
        yield "its .sha256 file is missing"
    elif shards.sha256(dataset.path(shard)) != recorded:
        yield "its bytes differ from its .sha256 file"


def _row_problems(dataset: Dataset, shard: Shard) -> Iterator[str]:
    differences = dataset.identity.differences(read_identity(dataset.path(shard)))
    if differences:
        yield f"it belongs to another dataset: {'; '.join(differences)}"
        return
    columns = dataset.read(shard)
    if not np.array_equal(columns.episode, np.arange(shard.start, shard.stop)):
        yield f"its rows are not the episodes {shard.start} to {shard.stop - 1}"
        return
    yield from _content_problems(columns, dataset.identity.seed)


def _content_problems(columns: Columns, seed: int) -> Iterator[str]:
    if not all(np.isfinite(values).all() for values in (columns.x, columns.xi, columns.y, columns.f)):
        yield "it holds numbers that are not finite"
    if not np.allclose(columns.y, (columns.bad != 0).mean(axis=1), atol=1e-6):
        yield "y is not the mean of the bad steps"
    width = columns.x.shape[1]
    drawn = (generator(seed, "controller", int(index)).random(width, dtype=np.float32) for index in columns.episode)
    if not all(np.array_equal(x, expected) for x, expected in zip(columns.x, drawn, strict=True)):
        yield f"its controllers are not those of seed {seed}"
