"""The stop latch of a robot: a file that holds everything until a named person takes it away."""

import json
from dataclasses import asdict, dataclass
from datetime import datetime, timezone
from pathlib import Path

from workers.host import durable


@dataclass(frozen=True)
class Stop:
    """Why a robot is stopped.

    Attributes:
        who: stopped it.
        reason: in words.
        at: UTC time, ISO 8601; "" where the file does not say.
    """

    who: str
    reason: str
    at: str = ""

    def __str__(self) -> str:
        return f"stopped by {self.who}{f' at {self.at}' if self.at else ''}: {self.reason}"


class Latch:
    """While the file is there, no command reaches the robot, whatever it says.

    Args:
        path: of the file.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def is_set(self) -> bool:
        """Whether the robot is stopped; one look at the file's name, cheap enough for every command."""
        return self.path.exists()

    def set(self, stop: Stop) -> bool:
        """Stop the robot, as everybody sees from now on; an earlier stop stays the one that is told.

        Args:
            stop: why.

        Returns:
            Whether it was not stopped before.

        Raises:
            OSError: the disk is full or broken.
        """
        if self.is_set:
            return False
        at = datetime.now(timezone.utc).isoformat(timespec="seconds")  # noqa: UP017 - also for Python 3.10
        return durable.create(self.path, json.dumps({**asdict(stop), "at": at}).encode() + b"\n")

    def keep(self) -> None:
        """Let the stop outlast a power cut.

        Raises:
            OSError: it is not set, or the disk is broken.
        """
        durable.sync(self.path)

    def read(self) -> "Stop | None":
        """Why the robot is stopped; None when it is not."""
        try:
            return Stop(**json.loads(self.path.read_bytes()))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, TypeError):
            return Stop("somebody", f"{self.path} is there, and cannot be read")

    def clear(self) -> None:
        """Let the robot move again.

        Raises:
            OSError: the file cannot be taken away.
        """
        self.path.unlink(missing_ok=True)
        durable.sync_folder(self.path.parent)
