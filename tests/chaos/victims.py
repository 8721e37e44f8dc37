"""What there is to kill below a process that a test has started, as Linux tells it."""

import os
import signal
import time
from contextlib import suppress
from pathlib import Path

PROC = Path("/proc")


def below(root: int) -> list[int]:
    """Process ids of all that descend from a process and live, that one excluded."""
    parents: dict[int, int] = {}
    for entry in PROC.iterdir():
        if entry.name.isdigit():
            with suppress(OSError):
                # The name, in brackets, may hold anything; state and parent follow it.
                state, parent = (entry / "stat").read_text().rpartition(")")[2].split()[:2]
                if state not in "ZX":
                    parents[int(entry.name)] = int(parent)
    found, new = [], [root]
    while new:
        new = [pid for pid, parent in parents.items() if parent in new]
        found += new
    return found


def actors(root: int) -> list[int]:
    """The rollout processes, those included whose constructor is still running."""
    return [pid for pid in below(root) if command(pid).startswith("ray::RolloutActor")]


def raylets(root: int) -> list[int]:
    """The processes that are Ray on a machine."""
    return [pid for pid in below(root) if Path(command(pid).partition(" ")[0]).name == "raylet"]


def command(pid: int) -> str:
    """How a process calls itself; "" when it is gone."""
    with suppress(OSError):
        return (PROC / str(pid) / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    return ""


def kill(pid: int) -> bool:
    """SIGKILL; whether there was still something to kill."""
    with suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)
        return True
    return False


def births(pids: list[int]) -> set[tuple[int, str]]:
    """Processes by id and start time, for Linux gives an id to another process before long."""
    return {(pid, born) for pid in pids if (born := _born(pid))}


def wait_until_gone(processes: set[tuple[int, str]], seconds: float) -> set[str]:
    """What the processes that still live when the time is over call themselves, or nothing once none does."""
    deadline = time.monotonic() + seconds
    while (left := {each for each in processes if _born(each[0]) == each[1]}) and time.monotonic() < deadline:
        time.sleep(0.05)
    return {f"{pid} {command(pid)}" for pid, _ in left}


def _born(pid: int) -> str:
    """When a process started, in ticks since the machine did; "" when it has ended."""
    with suppress(OSError):
        fields = (PROC / str(pid) / "stat").read_text().rpartition(")")[2].split()
        return "" if fields[0] in "ZX" else fields[19]
    return ""
