"""One motion: command after command at the robot's rate, each behind the guard and within the limits."""

import threading
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from workers.host.guard import Guard, now
from workers.host.limits import LimitWatch
from workers.host.machine import RobotMachine


class Stopped(RuntimeError):  # noqa: N818 - names what happened
    """The motion was stopped before its end; the robot was told to come to rest."""


class NotAtRest(RuntimeError):  # noqa: N818 - names what is known
    """The motion is over, and the robot may still move: its driver could not stop it."""


@dataclass
class Pulse:
    """What other threads may know of the motion under way.

    Attributes:
        moving: whether commands are being sent.
        late: how many of them came more than a period after their time.
        over: whether the motion under way has ended, however it did.
        at_rest: whether the robot stands still; not where its driver failed to stop it.
        sent: every command of this motion, behind the time at which it was sent, in s of `now`.
    """

    moving: bool = False
    late: int = 0
    over: threading.Event = field(default_factory=threading.Event)
    at_rest: bool = True
    sent: list[tuple[float, ...]] = field(default_factory=list)

    @property
    def last_command(self) -> float:
        """When the last command was sent, in s of `now`; 0 before the first."""
        return self.sent[-1][0] if self.sent else 0.0


def run(
    machine: RobotMachine, x: Sequence[float], watch: LimitWatch, guard: Guard, pulse: Pulse, period: float
) -> dict[str, Any]:
    """Run a controller from the reset pose to its end.

    Args:
        machine: the robot.
        x: the controller, each parameter in [0, 1].
        watch: of its commands; it has seen nothing yet.
        guard: that is asked before every command.
        pulse: is kept up to date.
        period: s between two commands; 0 for as fast as the machine goes.

    Returns:
        What the motion was worth, as `RobotMachine.end` measures it.

    Raises:
        Stopped: a stop, a deadline, silence or a limit ended it.
        Fault: the robot broke off by itself.
        NotAtRest: the driver failed to bring the robot to rest.
    """
    pulse.late, pulse.sent = 0, []
    machine.begin(x)
    guard.beat = now()  # getting ready may take any time, and moves nothing
    pulse.over = threading.Event()
    pulse.moving, pulse.at_rest = True, False
    try:
        _stream(machine, watch, guard, pulse, period)
    except Exception as error:
        _bring_to_rest(machine, error)
        pulse.at_rest = True
        raise
    else:
        pulse.at_rest = True
    finally:
        pulse.moving = False
        pulse.over.set()
    return machine.end()


def _bring_to_rest(machine: RobotMachine, why: Exception) -> None:
    try:
        machine.stop()
    except Exception as error:
        raise NotAtRest(f"{why}; and the driver's stop failed: {type(error).__name__}: {error}") from error


def _stream(machine: RobotMachine, watch: LimitWatch, guard: Guard, pulse: Pulse, period: float) -> None:
    due, step = time.monotonic(), 0
    while (command := machine.command(step)) is not None:
        found = watch.objection(command)
        if found:
            raise Stopped(f"step {step}: {found}")
        _wait(due, guard)
        found = guard.objection()
        if found:
            raise Stopped(found)
        machine.send(command)
        pulse.sent.append((now(), *command))
        step += 1
        pulse.late += period > 0 and time.monotonic() > due + 2 * period
        due = max(due + period, time.monotonic() - period)


def _wait(due: float, guard: Guard) -> None:
    """Until a command is due, or a stop is asked for."""
    left = due - time.monotonic()
    if left > 0:
        guard.asked.wait(left)


def watch_over(guard: Guard, pulse: Pulse, machine: RobotMachine, give_up: Callable[[str], None]) -> None:
    """Bring the robot to rest where a command hangs in its driver; runs in a thread of its own, for ever.

    Args:
        guard: whose conditions must hold.
        pulse: of the motion.
        machine: the robot.
        give_up: is called where even that does not end the motion; it ends the process.
    """
    while True:
        time.sleep(_LOOK_SECONDS)
        found = guard.objection() if pulse.moving else ""
        over = pulse.over
        if not found or over.wait(_GRACE_SECONDS):
            continue
        with suppress(Exception):  # the thread of the motion tells that; this one must live on
            machine.stop()
        if not over.wait(_GIVE_UP_SECONDS):
            give_up(found)


_LOOK_SECONDS = 0.01
_GRACE_SECONDS = 0.02
_GIVE_UP_SECONDS = 1.0
