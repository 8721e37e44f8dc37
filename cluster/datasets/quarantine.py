"""Shards that kept failing, put aside with their errors, and accounts of episodes that failed alone."""

import sys
from collections.abc import Iterator, Sequence

from cluster.failures import failure_text
from cluster.files import json_text
from workers.collection.shard import FailedEpisode
from workers.dataset.folder import Dataset
from workers.dataset.shards import Shard, shard_named
from workers.dataset.storage.location import Location, files

FOLDER = "quarantine"

ACCOUNTS = 100
"""So many failed episodes of one command have an account; the dataset itself says which failed."""


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
    path.write_text(json_text(content) + "\n", encoding="utf-8")
    return path


def keep_account(dataset: Dataset, failed: FailedEpisode) -> Location:
    """Keep what an episode failed of; the dataset holds it as `failed`, and no model learns from it.

    Args:
        dataset: to which it belongs.
        failed: the episode.

    Returns:
        Where it is kept, as text.
    """
    path = dataset.folder / FOLDER / f"episode-{failed.index:09d}.txt"
    path.parent.mkdir(exist_ok=True)
    identity = dataset.identity
    what = f"episode {failed.index} of seed {identity.seed}"
    text = failure_text(what, identity.setup, identity.bad_name, failed.x, failed.physics, failed.failure)
    path.write_text(text, encoding="utf-8")
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
