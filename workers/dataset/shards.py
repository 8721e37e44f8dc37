"""Shards: which files a dataset consists of, and how one of them comes to be, once and whole."""

import hashlib
import os
import re
import socket
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

WRITING = ".writing"
"""Folder, below the dataset, of files that are not finished."""

_NAME = re.compile(r"episodes-(\d{9})-(\d{9})\.parquet")
_BLOCK = 1 << 20


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


def present(folder: Path) -> list[Shard]:
    """The finished shards of a dataset, in order."""
    matches = (_NAME.fullmatch(path.name) for path in folder.iterdir())
    return sorted(Shard(int(match[1]), int(match[2])) for match in matches if match)


def missing(shards: Iterable[Shard], episodes: int, per_shard: int) -> Iterator[Shard]:
    """The shards still to be written for `episodes` episodes; a partial file is completed by a further one."""
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


def commit(folder: Path, shard: Shard, write: Callable[[Path], None]) -> Path:
    """Write a shard under a temporary name and publish it whole; the first of several writers wins.

    The file and its SHA-256 are on disk before its name appears, and the name is on disk before this returns.

    Args:
        folder: of the dataset.
        shard: what is written.
        write: writes the file at the path it is given.
    """
    writing = folder / WRITING
    writing.mkdir(exist_ok=True)
    temporary = writing / f"{shard.name}.{writer()}"
    try:
        write(temporary)
        _sync(temporary)
        _publish_digest(folder, shard, sha256(temporary))
        _link(temporary, folder / shard.name)
    finally:
        temporary.unlink(missing_ok=True)
    _sync(folder)
    return folder / shard.name


def digest_path(folder: Path, shard: Shard) -> Path:
    """Where the SHA-256 of a shard is kept, in the format of `sha256sum`."""
    return folder / f"{shard.name}.sha256"


def recorded_digest(folder: Path, shard: Shard) -> str:
    """The SHA-256 written beside a shard; "" when there is none."""
    path = digest_path(folder, shard)
    return path.read_text().split()[0] if path.exists() and path.stat().st_size else ""


def sha256(path: Path) -> str:
    """SHA-256 of a file's bytes."""
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            digest.update(block)
    return digest.hexdigest()


def writer() -> str:
    """Names this process among all processes of all machines: host, boot and process id."""
    return f"{socket.gethostname().replace('.', '_')}.{_boot()}.{os.getpid()}"


def sweep(folder: Path) -> int:
    """Remove unfinished files whose writer is known to be dead; returns how many."""
    writing = folder / WRITING
    dead = [path for path in writing.iterdir() if _dead(path.name)] if writing.exists() else []
    for path in dead:
        path.unlink(missing_ok=True)
    return len(dead)


def _dead(name: str) -> bool:
    host, boot, pid = name.rsplit(".", 3)[1:]
    if host != socket.gethostname().replace(".", "_"):
        return False  # nobody here can tell
    return boot != _boot() or not _alive(int(pid))


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return True


def _boot() -> str:
    path = Path("/proc/sys/kernel/random/boot_id")
    return path.read_text().strip() if path.exists() else "boot"


def _publish_digest(folder: Path, shard: Shard, digest: str) -> None:
    temporary = folder / WRITING / f"{shard.name}.sha256.{writer()}"
    temporary.write_text(f"{digest}  {shard.name}\n")
    _sync(temporary)
    if (folder / shard.name).exists():
        temporary.unlink()  # another writer was first: its file and digest stand
    else:
        temporary.replace(digest_path(folder, shard))


def _link(source: Path, target: Path) -> None:
    try:
        os.link(source, target)
    except FileExistsError:
        pass


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
