"""The lock of a campaign's folder: one process executes it, and its death frees the lock."""

import fcntl
import json
import os
import socket
import time
from dataclasses import asdict, dataclass
from pathlib import Path

from cluster.errors import UserError

FILE = "executor.lock"
POLL_SECONDS = 0.1
BOOT_ID = Path("/proc/sys/kernel/random/boot_id")


class FolderTaken(UserError):  # noqa: N818 - names the state of the folder
    """Another live process executes the campaign."""


@dataclass(frozen=True)
class Process:
    """Which process, on which machine, since which start of it.

    Attributes:
        host: name of the machine.
        boot: identifier of the machine's present start; "" where the system has none.
        pid: process id.
    """

    host: str
    boot: str
    pid: int

    @classmethod
    def current(cls) -> "Process":
        """The process that asks."""
        boot = BOOT_ID.read_text(encoding="utf-8").strip() if BOOT_ID.exists() else ""
        return cls(socket.gethostname(), boot, os.getpid())

    def __str__(self) -> str:
        return f"process {self.pid} on {self.host}"


class FolderLock:
    """Held from construction to `close` or the death of the process, whichever is first.

    Not `filelock`'s: the locked file says who holds it, and whoever asks that must not get in the way.

    Args:
        folder: of the campaign; on a local disk.
        patience: seconds to wait for another process to let go.

    Raises:
        FolderTaken: when another process still holds it; the message names that process.
    """

    def __init__(self, folder: Path, patience: float) -> None:
        path = folder / FILE
        self._file = path.open("a+", encoding="utf-8")
        deadline = time.monotonic() + patience
        while not _try_lock(self._file.fileno()):
            if time.monotonic() >= deadline:
                self._file.close()
                raise FolderTaken(
                    f"{folder} is being executed by {holder(folder)}; wait until it has ended, or end it"
                )
            time.sleep(POLL_SECONDS)
        self._file.truncate(0)
        self._file.write(json.dumps(asdict(Process.current())))
        self._file.flush()

    def close(self) -> None:
        """Lets another process in."""
        self._file.close()

    def __enter__(self) -> "FolderLock":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def holder(folder: Path) -> Process | None:
    """The live process that executes the campaign in a folder; None when there is none."""
    path = folder / FILE
    if not path.exists():
        return None
    with path.open(encoding="utf-8") as file:
        try:
            # A shared lock asks without getting in the way of others who ask.
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            text = file.read()
            return Process(**json.loads(text)) if text else Process("this machine", "", 0)
    return None


def _try_lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
