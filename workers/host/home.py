"""A robot's home: the folder, outside all campaigns, in which all that is true of the robot lies."""

import fcntl
import hashlib
import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from workers.host import durable
from workers.host.latch import Latch
from workers.host.ledger import Ledger

LIMITS = "limits.toml"
_LONGEST_SOCKET = 100  # bytes; the kernel takes 107


class RobotHeld(RuntimeError):  # noqa: N818 - names the state of the robot
    """Another process has the robot."""


@dataclass(frozen=True)
class RobotHome:
    """The files of one robot.

    Attributes:
        path: of the folder, absolute, on a local disk of the robot's machine.
        robot: name of the robot.
    """

    path: Path
    robot: str

    def make(self) -> "RobotHome":
        """Create the folder where it is missing.

        Returns:
            The same home.

        Raises:
            OSError: it cannot be made.
        """
        self.path.mkdir(parents=True, exist_ok=True)
        return self

    @property
    def ledger(self) -> Ledger:
        """What the robot ever did."""
        return Ledger(self.path / "ledger.jsonl")

    @property
    def latch(self) -> Latch:
        """Whether it is stopped."""
        return Latch(self.path / "STOPPED")

    @property
    def limits(self) -> Path:
        """Where its limits are written; the file may be missing."""
        return self.path / LIMITS

    @property
    def log(self) -> Path:
        """What the process at the robot, and its driver, said."""
        return self.path / "host.log"

    @property
    def live(self) -> Path:
        """What is seen of the motion under way; the file may be missing."""
        return self.path / "live.json"

    @property
    def trials(self) -> Path:
        """Where what was recorded of trials lies, in a folder of each, until their campaign has taken it."""
        return self.path / "trials"

    @property
    def socket(self) -> Path:
        """Where the process at the robot listens for a stop; elsewhere if the home's own path is too long."""
        own = self.path / "stop.socket"
        if len(os.fsencode(own)) <= _LONGEST_SOCKET:
            return own
        name = hashlib.sha256(os.fsencode(own)).hexdigest()[:16]
        return Path(tempfile.gettempdir()) / f"svaedc-{os.getuid()}-{name}.socket"

    @contextmanager
    def hold(self, holder: dict[str, Any]) -> Iterator[None]:
        """Have the robot for oneself; the death of the process gives it back.

        Args:
            holder: what others are told, plain values: process, campaign.

        Raises:
            RobotHeld: another process has it; the message names that one.
            OSError: the home cannot be written.
        """
        with (self.path / "holder.json").open("a+", encoding="utf-8") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                file.seek(0)
                raise RobotHeld(f"the robot {self.robot} is held by {_in_words(file.read())}") from None
            file.truncate(0)
            file.write(json.dumps(holder))
            file.flush()
            yield
            file.truncate(0)

    def holder(self) -> str:
        """Who has the robot, in words; "" when nobody has."""
        path = self.path / "holder.json"
        try:
            with path.open(encoding="utf-8") as file:
                try:
                    fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
                except BlockingIOError:
                    return _in_words(file.read())
        except OSError:
            pass
        return ""

    def write_host(self, facts: dict[str, Any]) -> None:
        """Note which process is at the robot, for those who must end it.

        Raises:
            OSError: the home cannot be written.
        """
        durable.replace(self.path / "host.json", json.dumps(facts).encode() + b"\n")

    def read_host(self) -> dict[str, Any]:
        """Which process was last at the robot; nothing where none is known."""
        try:
            found = json.loads((self.path / "host.json").read_bytes())
        except (OSError, ValueError):
            return {}
        return found if isinstance(found, dict) else {}


def _in_words(text: str) -> str:
    try:
        facts = json.loads(text)
        return f"the campaign in {facts['campaign']} (process {facts['pid']} on {facts['host']})"
    except (ValueError, KeyError, TypeError):
        return "another process"
