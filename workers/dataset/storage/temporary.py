"""The processes that write a dataset: what they call their unfinished files, and whether they still live."""

import os
import re
import socket
import time
from collections.abc import Iterable
from pathlib import Path

WRITING = ".writing"
"""This folder, below the dataset, holds the files that are not finished."""

_WRITER = re.compile(
    r"(?:.*\.)?(?P<host>[^.]+)\.(?P<boot>[^._]+)(?:_(?P<ids>\d+))?\.(?P<pid>\d+)(?:_(?P<born>\d+))?"
)


def writer() -> str:
    """The suffix of this process's temporary files: its place, its id, and its start where Linux tells it.

    Ids are given again, on a busy machine within minutes; no two processes share id and start.
    """
    pid = os.getpid()
    born = _born(pid)
    return f"{_place()}.{pid}{born and '_'}{born}"


def host() -> str:
    """This machine's name, as it stands in the names of unfinished files."""
    return socket.gethostname().replace(".", "_")


def is_dead(name: str) -> bool:
    """Whether the file's name says that its writer is a process of this machine that lives no longer.

    False for writers on other machines, or in other containers of this one, and for names without a writer:
    nobody here can tell.
    """
    match = _WRITER.fullmatch(name)
    if match is None or match["host"] != host():
        return False
    if match["boot"] != _boot():
        return True
    is_known_here = match["ids"] in {None, _ids()}
    return is_known_here and not _alive(int(match["pid"]), match["born"] or "")


def wait_for_end(writers: Iterable[str], seconds: float) -> None:
    """Wait until processes of this machine that were told to end have ended, or the time is over.

    Args:
        writers: what `writer` returned in them; those whose ids are not known here are not waited for.
        seconds: the longest wait.
    """
    deadline = time.monotonic() + seconds
    own = [name for name in writers if name.startswith(f"{_place()}.")]
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
        fields = (
            Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        )
        return fields[0], fields[19]
    except (OSError, IndexError):
        return "", ""


def _place() -> str:
    """What process ids are unique in: the machine, since its start, in a container."""
    ids = _ids()
    return f"{host()}.{_boot()}{ids and '_'}{ids}"


def _boot() -> str:
    path = Path("/proc/sys/kernel/random/boot_id")
    return path.read_text(encoding="utf-8").strip() if path.exists() else "boot"


def _ids() -> str:
    """The name space that process ids are of; "" where nobody tells."""
    path = Path("/proc/self/ns/pid")
    return str(path.stat().st_ino) if path.exists() else ""
