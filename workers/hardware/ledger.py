"""The robot's own append-only record of every motion, written before anything moves."""

import hashlib
import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from workers.hardware.driver import Measurement, Motion
from workers.host.durable import sync_folder

FILE = "starts.jsonl"
"""The ledger has this name in the folder of a campaign, whatever the robot."""

STARTED = "started"
ENDED = "ended"


class MotionLedger:
    """One JSON object per line, on disk before `start` or `end` returns; a torn last line never happened.

    Args:
        path: of the file; its folder must exist.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    def start(self, trial_id: str, x: Float[np.ndarray, " D"]) -> None:
        """Records that a trial is about to move the robot.

        Args:
            trial_id: of the trial.
            x: its controller, [D]; the SHA-256 of its float64 is kept.

        Raises:
            RuntimeError: when the ledger already knows the trial: no trial moves a robot twice.
        """
        if self.motion(trial_id).started:
            raise RuntimeError(
                f"trial {trial_id} has already moved the robot according to {self.path}; "
                "it is not run again: resolve it, and a repetition gets a trial of its own"
            )
        digest = hashlib.sha256(x.astype("<f8").tobytes()).hexdigest()
        self._append({"event": STARTED, "trial": trial_id, "x": digest, "pid": os.getpid()})

    def end(self, trial_id: str, measurement: Measurement) -> None:
        """Records that a trial came to its end.

        Args:
            trial_id: of the trial.
            measurement: what it measured.
        """
        self._append({"event": ENDED, "trial": trial_id, "measurement": asdict(measurement)})

    def motion(self, trial_id: str) -> Motion:
        """What is known of one trial."""
        entries = [entry for entry in self.entries() if entry["trial"] == trial_id]
        ends = [Measurement(**entry["measurement"]) for entry in entries if entry["event"] == ENDED]
        return Motion(any(entry["event"] == STARTED for entry in entries), ends[-1] if ends else None)

    def entries(self) -> list[dict[str, Any]]:
        """Every complete line, oldest first."""
        if not self.path.exists():
            return []
        # A crash can leave half a line, even one that a later append closed with a newline.
        return [entry for line in self.path.read_bytes().split(b"\n") if (entry := _parse(line)) is not None]

    def _append(self, entry: dict[str, Any]) -> None:
        line = json.dumps(entry, sort_keys=True, allow_nan=False).encode() + b"\n"
        is_new = not self.path.exists()
        with self.path.open("ab+") as file:
            if file.tell() > 0:
                file.seek(-1, os.SEEK_END)
                # The torn line of a crash must not swallow this one.
                line = line if file.read(1) == b"\n" else b"\n" + line
            file.write(line)
            file.flush()
            os.fsync(file.fileno())
        if is_new:
            sync_folder(self.path.parent)


def _parse(line: bytes) -> dict[str, Any] | None:
    try:
        entry = json.loads(line)
    except ValueError:
        return None
    return entry if isinstance(entry, dict) else None
