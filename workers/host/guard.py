"""The conditions that must hold before every single command."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from workers.host.latch import Latch

SILENCE_SECONDS = 1.0
"""Without a sign of life of whoever drives the host for so long, a robot stops."""
_READING_SECONDS = 0.02
CLOCK = time.CLOCK_BOOTTIME if hasattr(time, "CLOCK_BOOTTIME") else time.CLOCK_MONOTONIC
"""It goes on while a machine sleeps: a laptop that wakes up does not go on where it was."""


def now() -> float:
    """Seconds of that clock, which all processes of a machine share."""
    return time.clock_gettime(CLOCK)


@dataclass
class Guard:
    """Says before every command whether it may be sent.

    Attributes:
        latch: of the robot.
        silence: s without a sign of life after which nothing is sent.
        deadline: moment after which nothing is sent, in s of `now`.
        beat: moment of the last sign of life.
        asked: whether a stop was asked for; set from any thread.
        why: why it was asked for.
    """

    latch: Latch
    silence: float = SILENCE_SECONDS
    deadline: float = 0.0
    beat: float = 0.0
    asked: threading.Event = field(default_factory=threading.Event)
    why: str = ""

    def stop(self, why: str) -> None:
        """Ask for a stop; the first reason is kept."""
        self.why = self.why or why
        self.asked.set()

    def objection(self) -> str:
        """Why no command may be sent now; "" when one may."""
        return next((found for condition in _CONDITIONS if (found := condition(self))), "")


def _stop_request(guard: Guard) -> str:
    return (guard.why or "a stop was asked for") if guard.asked.is_set() else ""


def _latch_reason(guard: Guard) -> str:
    return str(guard.latch.read() or "") if guard.latch.is_set else ""


def _silent(guard: Guard) -> str:
    if now() - guard.beat <= guard.silence:
        return ""
    time.sleep(_READING_SECONDS)  # a driver that held Python's lock kept signs of life from being read
    silence = now() - guard.beat
    if silence <= guard.silence:
        return ""
    return f"no sign of life from the process that drives the host for {silence:.1f} s"


def _late(guard: Guard) -> str:
    over = now() - guard.deadline
    return f"the trial's time is over since {over:.2f} s" if over > 0 else ""


_CONDITIONS: "tuple[Callable[[Guard], str], ...]" = (_latch_reason, _stop_request, _silent, _late)
"""A command is sent only where none of these objects."""
