"""Putting a recomputed shard in the place of a broken one: at once, and with the old bytes kept."""

from collections.abc import Callable
from enum import Enum
from pathlib import Path

from workers.dataset.shards import Shard, digest_line, digest_path, readable_sha256, sha256
from workers.dataset.storage.atomic import link, move, synchronise, temporary_file
from workers.dataset.storage.location import Location

REPLACED = ".replaced"
"""This folder, below the dataset, holds what stood in a shard's place; readers of Parquet skip its name."""


class Repair(Enum):
    """What became of a shard that was written anew."""

    ADDED = "was missing and has been added"
    REPLACED = "has been replaced; what was there is kept in .replaced"
    DIGEST = "was whole; its .sha256 file has been written anew"


def replace(folder: Location, shard: Shard, write: Callable[[Path], None]) -> Repair:
    """Write a shard anew; its name holds the old bytes or the new ones at every moment, never others.

    A file that holds the new bytes already is not touched.

    Args:
        folder: of the dataset.
        shard: what is written.
        write: writes the file at the path it is given.

    Returns:
        What became of the shard.

    Raises:
        OSError: the disk is full or not writable; the old file is where it was.
    """
    target = folder / shard.name
    with temporary_file(folder, shard.name) as temporary:
        write(temporary)
        synchronise(temporary)
        digest = sha256(temporary)
        is_there = target.exists()
        if is_there and readable_sha256(target) == digest:
            _write_digest(folder, shard, digest)
            return Repair.DIGEST
        if is_there:
            keep_aside(folder, target)
        _write_digest(folder, shard, digest)
        move(temporary, target)
        synchronise(folder)
        return Repair.REPLACED if is_there else Repair.ADDED


def keep_aside(folder: Location, path: Location) -> Location:
    """Give a file a second name in `.replaced`, with the start of its SHA-256; equal bytes are kept once.

    One that the disk no longer reads has no SHA-256, and is called unreadable.

    Args:
        folder: of the dataset.
        path: of the file.

    Returns:
        The second name.
    """
    aside = folder / REPLACED
    aside.mkdir(exist_ok=True)
    kept = aside / f"{path.name}.{readable_sha256(path)[:12]}"
    link(path, kept)
    return kept


def _write_digest(folder: Location, shard: Shard, digest: str) -> None:
    target = digest_path(folder, shard)
    with temporary_file(folder, target.name) as temporary:
        temporary.write_text(digest_line(shard, digest), encoding="utf-8")
        synchronise(temporary)
        move(temporary, target)
        synchronise(folder)
