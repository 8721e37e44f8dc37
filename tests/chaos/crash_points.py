"""The places at which a process of a campaign may die: found in the code, and killed at on demand.

A point is a line that calls one of `CALLS`, and a side of it: before, or after. A process that `watch` traces
writes down every point that it passes, and dies of SIGKILL at the one it is told to.
"""

import ast
import os
import signal
import sys
import threading
from collections import Counter
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
CALLS = {
    "workers/host/serve.py": ("make_folder", "ledger.append", "self.say", "motion.run", "write_table"),
    "workers/host/motion.py": ("machine.begin", "machine.send", "machine.end"),
    "workers/host/durable.py": ("file.write", "os.fsync", "unfinished.replace", "sync_folder"),
    "workers/host/recording.py": ("folder.mkdir", "file.write"),
    "workers/hardware/hosted.py": ("self._ask", "HostProcess", "started.tell"),
    "workers/hardware/host_process.py": ("subprocess.Popen", "home.write_host"),
    "workers/hardware/gate.py": ("ledger.append",),
    "cluster/hardware/campaign.py": ("record", "propose", "gate.grant", "gate.plan", "robot.run"),
    "cluster/hardware/journal.py": ("self._write",),
    "cluster/hardware/executor.py": (
        "home.hold",
        "campaign.recover",
        "attachments.take_over",
        "journal.create",
    ),
    "cluster/hardware/record/attachments.py": (
        "unfinished.replace",
        "append",
        "path.unlink",
        "recorded.rmdir",
    ),
}
"""What is durable, what moves the robot, and what is said to another process."""
ELSEWHERE = {
    "workers/hardware/gate.py": {'"who": who': "a person vouches for a folder: a command of its own"},
    "workers/host/serve.py": {
        '"what": "hangs"': "a driver that hangs: tests/workers/host/test_hosted.py",
        '"refused", "trial": trial, "reason": _reason_of': "what no host of ours is ever told: the same",
    },
    "cluster/hardware/campaign.py": {
        '{"reason": reason}': "no method suggests a controller outside the cube",
        '"the driver failed: ': "a host answers whatever a driver does",
    },
}
"""What stands on lines that no campaign passes, and why."""


def points() -> list[str]:
    """Every point, as `file:line side`, in the order of the files."""
    return [
        f"{name}:{line} {side}" for name in CALLS for line in lines_of(name) for side in ("before", "after")
    ]


def lines_of(name: str) -> list[int]:
    """The lines of a file that call one of its `CALLS`, but for those that are passed elsewhere."""
    text = (ROOT / name).read_text(encoding="utf-8")
    source = text.splitlines()
    found = {node.lineno for node in ast.walk(ast.parse(text)) if is_one_of(node, CALLS[name])}
    excused = ELSEWHERE.get(name, {})
    return sorted(line for line in found if not any(words in source[line - 1] for words in excused))


def is_one_of(node: ast.AST, calls: tuple[str, ...]) -> bool:
    """Whether a node is a call of one of these; `ledger.append` is also `self.home.ledger.append`."""
    if not isinstance(node, ast.Call):
        return False
    name = ast.unparse(node.func)
    return any(name == call or name.endswith(f".{call}") for call in calls)


class Watch:
    """Writes down every point that this process passes, and dies at one of them.

    Args:
        log: the points are added to it, one a line.
        kill_at: a point, and behind a comma how often it is passed before; "" for none.
    """

    def __init__(self, log: Path, kill_at: str) -> None:
        self._target, _, hit = kill_at.rpartition(",")
        self._hit = int(hit or 0)
        self._passed: Counter[str] = Counter()
        self._log = os.open(log, os.O_WRONLY | os.O_APPEND | os.O_CREAT)
        self._places = {
            str(ROOT / name): {line: f"{name}:{line}" for line in lines_of(name)} for name in CALLS
        }

    def trace(self, frame: Any, event: str, _: Any) -> Any:
        """What `sys.settrace` calls at the beginning of every function."""
        places = self._places.get(frame.f_code.co_filename)
        return Steps(self, places).trace if event == "call" and places is not None else None

    def reach(self, point: str) -> None:
        """The process is at a point."""
        os.write(self._log, f"{point}\n".encode())
        if point == self._target and self._passed[point] == self._hit:
            os.kill(os.getpid(), signal.SIGKILL)
        self._passed[point] += 1


class Steps:
    """One call of a function, line by line."""

    def __init__(self, watch: Watch, places: dict[int, str]) -> None:
        self._watch, self._places, self._left = watch, places, ""

    def trace(self, frame: Any, event: str, _: Any) -> Any:
        """What is called before every line, and when the function is left."""
        if self._left:
            self._watch.reach(f"{self._left} after")
            self._left = ""
        if event == "line" and frame.f_lineno in self._places:
            self._left = self._places[frame.f_lineno]
            self._watch.reach(f"{self._left} before")
        return self.trace


def watch(log: Path, kill_at: str) -> None:
    """From now on, write down every point that this process passes; die at one of them; see `Watch`."""
    watching = Watch(log, kill_at)
    threading.settrace(watching.trace)
    sys.settrace(watching.trace)
