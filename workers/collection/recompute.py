"""Rolling out a shard once more: to prove the one that is there, or to replace it."""

from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from jaxtyping import Bool

from workers.attempts import Attempts
from workers.collection.independence import order_dependence
from workers.collection.shard import is_of_users, roll_out
from workers.dataset import schema
from workers.dataset.folder import Dataset
from workers.dataset.inventory import lost_shards
from workers.dataset.replacement import Repair, replace
from workers.dataset.schema import Columns
from workers.dataset.shards import Shard, sha256
from workers.dataset.storage.location import Location, fetch
from workers.dataset.verification import Defect, file_problems
from workers.isolation import IsolatedAttempts
from workers.setups import Setup


def draw_shards(dataset: Dataset, count: int, rng: np.random.Generator) -> list[Shard]:
    """Draw finished shards at random, none twice.

    Args:
        dataset: from which they are drawn.
        count: how many.
        rng: that draws.

    Returns:
        That many shards, all if there are fewer, in order.
    """
    shards = dataset.shards()
    chosen = rng.choice(len(shards), size=min(count, len(shards)), replace=False)
    return [shards[int(place)] for place in np.sort(chosen)]


def rederive(setup: Setup, dataset: Dataset, shard: Shard) -> list[Defect]:
    """Roll out a shard again and compare the bytes of the two files; nothing is changed.

    Bytes that differ are compared once more as numbers, because another processor may round otherwise, and
    another version of PyArrow may write the same episodes as other bytes. Two episodes are rolled out in
    another order as well: an environment that keeps something of the episode before gives the same bytes in
    the same order.

    Args:
        setup: of the dataset.
        dataset: to which the shard belongs.
        shard: which episodes.

    Returns:
        No defect if the bytes are the same, otherwise one that says what differs.
    """
    with TemporaryDirectory() as folder:
        again = Path(folder) / shard.name
        attempts = _attempts_for(setup)
        episodes = roll_out(setup, dataset, shard, attempts)
        schema.write(again, dataset.identity, shard.start, episodes)
        kept = fetch(dataset.path(shard))
        problems = [] if sha256(again) == sha256(kept) else [_told_difference(kept, again, dataset)]
    problems.append(order_dependence(setup, dataset.draws(), shard.start, episodes, attempts))
    return [Defect(shard.name, problem) for problem in problems if problem]


def _told_difference(kept: Location, again: Path, dataset: Dataset) -> str:
    try:
        return _difference(schema.read(kept, dataset.identity), schema.read(again, dataset.identity))
    except ValueError as error:
        return str(error)


def find_broken(dataset: Dataset) -> Iterator[tuple[Shard, bool]]:
    """Every shard there is or was, and whether it must be written anew."""
    for shard in dataset.shards():
        yield shard, bool(file_problems(dataset, shard))
    for shard in lost_shards(dataset):
        yield shard, True


def repair(setup: Setup, dataset: Dataset, shard: Shard) -> Repair:
    """Roll out a shard again and put it in its place; what was there is kept aside if it differs.

    Args:
        setup: of the dataset.
        dataset: to which the shard belongs.
        shard: which episodes.

    Returns:
        What became of the shard.

    Raises:
        OSError: the disk is full or not writable; the old file is where it was.
    """
    return replace(dataset.folder, shard, lambda path: _write(setup, dataset, shard, path))


def _write(setup: Setup, dataset: Dataset, shard: Shard, path: Path) -> None:
    episodes = roll_out(setup, dataset, shard, _attempts_for(setup))
    schema.write(path, dataset.identity, shard.start, episodes)


def _attempts_for(setup: Setup) -> type[Attempts | IsolatedAttempts]:
    """Users' code may hang or end its process, and this process does other things besides."""
    return IsolatedAttempts if is_of_users(setup) else Attempts


def _difference(kept: Columns, again: Columns) -> str:
    if len(kept.episode) != len(again.episode):
        return f"it holds {len(kept.episode)} rows instead of {len(again.episode)}"
    differ = _rows_that_differ(kept, again)
    if not differ.any():
        return "recomputed here, its episodes are the same; only their encoding differs"
    largest = float(np.nanmax(np.abs(kept.xi - again.xi)))
    return (
        f"recomputed here, {differ.sum()} of its {len(differ)} episodes differ, the first of them "
        f"{kept.episode[differ][0]}; ξ by up to {largest:.3g}"
    )


def _rows_that_differ(kept: Columns, again: Columns) -> Bool[np.ndarray, " n"]:
    differ = np.array(kept.stop) != np.array(again.stop)
    pairs = [(getattr(kept, name), getattr(again, name)) for name in ("episode", "x", "xi", "bad", "y", "f")]
    pairs += [(kept.physics[name], again.physics[name]) for name in kept.physics]
    for one, other in pairs:
        differ |= (one != other).reshape(len(differ), -1).any(axis=1)
    return differ
