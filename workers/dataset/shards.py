"""Shards: which files a dataset consists of, and how one of them comes to be, once and whole."""

import hashlib
import re
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from workers.dataset.storage.atomic import link, move, synchronise, temporary_file
from workers.dataset.storage.location import Location, fetch
from workers.dataset.storage.s3_connection import StoreError
from workers.dataset.storage.temporary import WRITING, is_dead

_NAME = re.compile(r"episodes-(\d{9})-(\d{9})\.parquet")
_BLOCK = 1 << 20
_READERS = 8

UNREADABLE = "unreadable"
"""It stands in the place of a digest where the disk does not give the bytes."""


@dataclass(frozen=True, order=True)
class Shard:
    """The episodes start ≤ index < stop, one file."""

    start: int
    stop: int

    def __post_init__(self) -> None:
        """Refuse empty and negative ranges."""
        if not 0 <= self.start < self.stop:
            raise ValueError(f"a shard needs 0 <= start < stop, got {self.start} and {self.stop}")

    @property
    def name(self) -> str:
        """The file's name."""
        return f"episodes-{self.start:09d}-{self.stop:09d}.parquet"

    @property
    def episodes(self) -> int:
        """How many episodes it holds."""
        return self.stop - self.start


def present(folder: Location) -> list[Shard]:
    """The finished shards of a dataset, in order."""
    return sorted(shard for path in folder.iterdir() for shard in shard_named(path.name))


def shard_named(name: str) -> Iterator[Shard]:
    """The shard that a file name stands for; none for a name of another kind."""
    match = _NAME.fullmatch(name)
    if match and int(match[1]) < int(match[2]):
        yield Shard(int(match[1]), int(match[2]))


def missing(shards: Iterable[Shard], episodes: int, per_shard: int) -> Iterator[Shard]:
    """List the shards still to be written; a further file completes a partial one.

    Args:
        shards: that are there, in any order.
        episodes: how many there shall be, from index 0 on.
        per_shard: episodes of a whole shard.

    Yields:
        Each missing range, in order; none goes past a multiple of per_shard.
    """
    done = sorted(shards)
    covered = 0
    position = 0
    for block in range(0, episodes, per_shard):
        end = min(block + per_shard, episodes)
        covered = max(covered, block)
        while position < len(done) and done[position].start < end:
            if done[position].start > covered:
                yield Shard(covered, done[position].start)
            covered = max(covered, done[position].stop)
            position += 1
        if covered < end:
            yield Shard(covered, end)
            covered = end


def episodes_in(present: Iterable[Shard]) -> int:
    """Episodes that some shards hold; one that is in two of them counts once."""
    total = covered = 0
    for shard in sorted(present):
        total += max(0, shard.stop - max(shard.start, covered))
        covered = max(covered, shard.stop)
    return total


def commit(folder: Location, shard: Shard, write: Callable[[Path], None]) -> Location:
    """Write a shard aside and publish it whole; the first of several writers wins.

    The file and its SHA-256 are safe before its name appears, and the name is safe before this returns.

    Args:
        folder: of the dataset.
        shard: what is written.
        write: writes the file at the path it is given.

    Returns:
        Where the shard lies.
    """
    with temporary_file(folder, shard.name) as temporary:
        write(temporary)
        synchronise(temporary)
        _publish_digest(folder, shard, sha256(temporary))
        link(temporary, folder / shard.name)
    return folder / shard.name


def digest_path(folder: Location, shard: Shard) -> Location:
    """Name the file with the SHA-256 of a shard, in the format of `sha256sum`.

    Args:
        folder: of the dataset.
        shard: whose digest it is.

    Returns:
        The path, whether or not there is such a file.
    """
    return folder / f"{shard.name}.sha256"


def digest_line(shard: Shard, digest: str) -> str:
    """Word the content of the file at `digest_path`.

    Args:
        shard: whose digest it is.
        digest: SHA-256 in hexadecimal.

    Returns:
        One line, as `sha256sum` writes it.
    """
    return f"{digest}  {shard.name}\n"


def recorded_digest(folder: Location, shard: Shard) -> str:
    """Read the SHA-256 written beside a shard.

    Args:
        folder: of the dataset.
        shard: whose digest it is.

    Returns:
        The first word of the file; "" when there is none.
    """
    try:
        words = digest_path(folder, shard).read_text(errors="replace").split()
    except FileNotFoundError:
        return ""
    return words[0] if words else ""


def recorded_digests(folder: Location, shards: Iterable[Shard]) -> Iterator[str]:
    """Read the SHA-256 beside many shards, several at a time: an object store takes its time for each.

    Args:
        folder: of the dataset.
        shards: whose digests they are.

    Yields:
        One digest per shard, in their order; "" where there is none.
    """
    with ThreadPoolExecutor(_READERS) as readers:
        yield from readers.map(lambda shard: recorded_digest(folder, shard), shards)


def sha256(path: Location) -> str:
    """SHA-256 of a file's bytes."""
    digest = hashlib.sha256()
    with fetch(path).open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def readable_sha256(path: Location) -> str:
    """The same, or `UNREADABLE` where the disk does not give the bytes; a store that is away raises."""
    try:
        return sha256(path)
    except StoreError:
        raise
    except OSError:
        return UNREADABLE


def sweep(folder: Location) -> int:
    """Remove unfinished files whose writer is known to be dead; returns how many."""
    writing = folder / WRITING
    dead = [path for path in writing.iterdir() if is_dead(path.name)] if writing.exists() else []
    for path in dead:
        path.unlink(missing_ok=True)
    return len(dead)


def _publish_digest(folder: Location, shard: Shard, digest: str) -> None:
    """Before the shard itself, so that no shard is without one; a shard already there keeps its own."""
    target = digest_path(folder, shard)
    with temporary_file(folder, target.name) as temporary:
        temporary.write_text(digest_line(shard, digest))
        synchronise(temporary)
        if not (folder / shard.name).exists():
            move(temporary, target)
