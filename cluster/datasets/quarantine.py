"""Shards that kept failing, put aside with their errors."""

import json
import sys
from collections.abc import Iterator, Sequence

from workers.dataset.folder import Dataset
from workers.dataset.shards import Shard, shard_named
from workers.dataset.storage.location import Location, files

FOLDER = "quarantine"


def put_aside(dataset: Dataset, shard: Shard, errors: Sequence[str]) -> Location:
    """Keep the errors of a shard that was given up; the next `collect` tries it afresh.

    Args:
        dataset: to which it belongs.
        shard: what was given up.
        errors: one text of each attempt.

    Returns:
        Where they are kept, as JSON.
    """
    path = _path(dataset, shard)
    path.parent.mkdir(exist_ok=True)
    content = {"start": shard.start, "stop": shard.stop, "errors": list(errors)}
    path.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")
    return path


def quarantined_shards(dataset: Dataset, episodes: int = sys.maxsize) -> list[Shard]:
    """List the shards put aside that are needed still.

    A later collection may have cut their episodes into other shards, so what counts is the episodes.

    Args:
        dataset: to which they belong.
        episodes: how many it shall hold; those beyond are not needed.

    Returns:
        The shards, cut as they were when they were put aside, in the order of their names.
    """
    return [shard for shard in _put_aside(dataset) if _is_needed(dataset, shard, episodes)]


def release(dataset: Dataset) -> None:
    """Forget the errors of episodes that have been collected since."""
    for shard in _put_aside(dataset):
        if not _is_needed(dataset, shard, shard.stop):
            _path(dataset, shard).unlink(missing_ok=True)


def _put_aside(dataset: Dataset) -> Iterator[Shard]:
    for path in files(dataset.folder / FOLDER, "*.json"):
        yield from shard_named(path.name.removesuffix(".json"))


def _is_needed(dataset: Dataset, shard: Shard, episodes: int) -> bool:
    missing = dataset.missing(min(shard.stop, episodes))
    return any(shard.start < other.stop and other.start < shard.stop for other in missing)


def _path(dataset: Dataset, shard: Shard) -> Location:
    return dataset.folder / FOLDER / f"{shard.name}.json"
