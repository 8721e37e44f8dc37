"""How a file comes to be, once and whole.

On a disk it is written under its writer's name, then linked to its own. In an object store it is put there by
one request, which leaves nothing if it fails; until then it exists in its writer's memory only.
"""

import os
import re
import socket
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from workers.dataset.location import Location

WRITING = ".writing"
"""Folder, below the dataset, of files that are not finished."""

_WRITER = re.compile(r"(?:.*\.)?(?P<host>[^.]+)\.(?P<boot>[^.]+)\.(?P<pid>\d+)(?:_(?P<born>\d+))?")


@contextmanager
def temporary_file(folder: Location, name: str) -> Iterator[Path]:
    """A path for a file of this writer that is not finished; whatever lies there is removed at the end."""
    if not isinstance(folder, Path):
        with _file_in_memory(name) as temporary:
            yield temporary
        return
    writing = folder / WRITING
    writing.mkdir(exist_ok=True)
    temporary = writing / f"{name}.{writer()}"
    try:
        yield temporary
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def _file_in_memory(name: str) -> Iterator[Path]:
    """A file that ends with this process, however that ends."""
    handle = os.memfd_create(name)
    try:
        yield Path(f"/proc/self/fd/{handle}")
    finally:
        os.close(handle)


def link(source: Location, target: Location) -> None:
    """Give a finished file its final name, durably, unless another writer was first.

    In an object store two writers at the same moment may both write, so the bytes must be the same.
    """
    if isinstance(source, Path) and isinstance(target, Path):
        with suppress(FileExistsError):
            os.link(source, target)
        synchronise(target.parent)
    elif not target.exists():
        target.write_bytes(source.read_bytes())


def move(source: Path, target: Location) -> None:
    """Let a finished file take the place of what has its final name."""
    if isinstance(target, Path):
        source.replace(target)
    else:
        target.write_bytes(source.read_bytes())


def synchronise(path: Location) -> None:
    """Wait until a file's bytes, or a folder's names, are on disk; objects are safe once they are there."""
    if not isinstance(path, Path):
        return
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def writer() -> str:
    """The suffix of this process's temporary files: host, boot, process id, and start where Linux tells it.

    Ids are given again, on a busy machine within minutes; no two processes share id and start.
    """
    pid = os.getpid()
    born = _born(pid)
    return f"{host()}.{_boot()}.{pid}{born and '_'}{born}"


def host() -> str:
    """This machine's name, as it stands in the names of unfinished files."""
    return socket.gethostname().replace(".", "_")


def is_dead(name: str) -> bool:
    """Whether the file's name says that its writer is a process of this machine that lives no longer.

    False for writers on other machines and for names without a writer: nobody here can tell.
    """
    match = _WRITER.fullmatch(name)
    if match is None or match["host"] != host():
        return False
    return match["boot"] != _boot() or not _alive(int(match["pid"]), match["born"] or "")


def wait_for_end(writers: Iterable[str], seconds: float) -> None:
    """Wait until processes of this machine that were told to end have ended, or the time is over.

    Args:
        writers: what `writer` returned in them; those of other machines are not waited for.
        seconds: the longest wait.
    """
    deadline = time.monotonic() + seconds
    own = [name for name in writers if name.startswith(f"{host()}.")]
    while time.monotonic() < deadline and not all(is_dead(name) for name in own):
        time.sleep(0.02)


def _alive(pid: int, born: str) -> bool:
    """Whether the process that began then, if that is known, is still there.

    One that has ended and only waits for its parent, which in a container may never ask, is not.
    """
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass  # it is another user's, so it lives
    state, begun = _state(pid)
    return state != "Z" and begun in {"", born or begun}


def _born(pid: int) -> str:
    """When a process began, in ticks since the machine did; "" where nobody tells."""
    return _state(pid)[1]


def _state(pid: int) -> tuple[str, str]:
    """A process's state, as a letter, and when it began; empty texts where nobody tells."""
    try:
        # The name, in brackets, may hold anything; the state follows it, and 19 further on the start.
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
        return fields[0], fields[19]
    except (OSError, IndexError):
        return "", ""


def _boot() -> str:
    path = Path("/proc/sys/kernel/random/boot_id")
    return path.read_text().strip() if path.exists() else "boot"
