"""What a campaign asks of a robot: run one controller, stop, and tell what it ever did."""

import math
import re
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float

SHA256 = re.compile(r"[0-9a-f]{64}")


class RobotFault(RuntimeError):  # noqa: N818 - a fault is what roboticists call it
    """The robot broke off a trial, stands still, and has no valid objective to report."""


class RobotStopped(RobotFault):
    """The trial was stopped, or not let begin; the robot is at rest, and nothing is to be learnt from it."""


class RobotBroke(RobotFault):
    """Nobody knows what the robot did: its driver failed, or its process died in motion."""


@dataclass(frozen=True)
class Measurement:
    """What one trial on a robot yielded.

    Attributes:
        f: objective, to be maximised.
        y: badness, the share of bad steps, in [0, 1].
        stop: stop reason, "" when the controller ran to its end.
        seconds: duration of the trial, in s.
        evidence: SHA-256 of the trajectory's bytes, 64 hexadecimal digits.
    """

    f: float
    y: float
    stop: str
    seconds: float
    evidence: str

    def __post_init__(self) -> None:
        if not math.isfinite(self.f):
            raise ValueError(f"objective f must be finite, got {self.f}")
        if not 0.0 <= self.y <= 1.0:
            raise ValueError(f"badness y must lie in [0, 1], got {self.y}")
        if not 0.0 <= self.seconds < math.inf:
            raise ValueError(f"seconds must be finite and at least 0, got {self.seconds}")
        if not SHA256.fullmatch(self.evidence):
            raise ValueError(f"evidence must be a SHA-256 in hexadecimal, got {self.evidence!r}")


@dataclass(frozen=True)
class Motion:
    """What the robot's own ledger says of one trial.

    Attributes:
        started: whether a motion of the trial ever began.
        measurement: what it measured, if it ever came to its end.
        certain: whether the ledger vouches for that; a line that was cut off may have been the trial's.
    """

    started: bool
    measurement: Measurement | None
    certain: bool = True


@runtime_checkable
class RobotDriver(Protocol):
    """A robot that runs one controller at a time.

    Attributes:
        name: of the robot, as in the registry.
        setup: name of the setup the robot realises.
    """

    name: str
    setup: str

    def run(self, trial_id: str, x: Float[np.ndarray, " D"]) -> Measurement:
        """Moves the robot once under controller x, from its reset pose to its end.

        Args:
            trial_id: never seen by this robot before; a known one is refused before anything moves.
            x: the controller, [D], in [0, 1].

        Returns:
            What the trial measured.

        Raises:
            RobotFault: when the robot broke off, stands still and measured nothing.
        """

    def stop(self) -> None:
        """Brings the robot to rest; may be called at any time and from any thread."""

    def motion(self, trial_id: str) -> Motion:
        """What the robot's ledger, which outlives every process, says of a trial."""
