"""The life of a host: it has one robot, answers its lines, and comes to rest when nobody asks any more."""

import hashlib
import math
import os
import queue
import re
import sys
import threading
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, BinaryIO

from workers.host import live, motion, protocol, stop
from workers.host.guard import SILENCE_SECONDS, Guard, now
from workers.host.home import RobotHome
from workers.host.ledger import LedgerDamaged
from workers.host.limits import LimitWatch, RobotLimits, first_objection
from workers.host.machine import Fault, RobotMachine
from workers.host.motion import Pulse, Stopped
from workers.host.recording import COMMANDS, make_folder, travel, write_table

STARTED, ENDED, BROKEN = "started", "ended", "broken"
"""Events of the ledger: a trial is about to move the robot; it came to its end; it did not."""


@dataclass
class Host:
    """What serves one robot.

    Attributes:
        home: of the robot.
        machine: the robot.
        limits: of the robot.
        say: sends a message to whoever drives the host.
        period: s between two commands; 0 for as fast as it goes.
        silence: s without a sign of life of whoever drives the host after which it stops.
    """

    home: RobotHome
    machine: RobotMachine
    limits: RobotLimits
    say: Callable[[Mapping[str, Any]], None]
    period: float
    silence: float = SILENCE_SECONDS
    pulse: Pulse = field(default_factory=Pulse)
    guard: Guard = field(init=False)
    _under_way: "dict[str, Any]" = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Listen for stops from now on."""
        self.guard = Guard(self.home.latch, self.silence)
        facts = {"pid": os.getpid(), "rest": self.machine.rest.stop}
        self._stop_listening = stop.listen(self.home, self.guard, self.pulse, lambda: facts)
        live.publish(self.home.live, self.pulse, lambda: self._under_way)
        threading.Thread(
            target=motion.watch_over,
            args=(self.guard, self.pulse, self.machine, self._give_up),
            name="watchdog",
            daemon=True,
        ).start()

    def greet(self) -> None:
        """Say who is here."""
        self.say(
            {
                "say": "hello",
                "protocol": protocol.VERSION,
                "pid": os.getpid(),
                "rest": asdict(self.machine.rest),
                "period": self.machine.period,
                "channels": [asdict(channel) for channel in self.machine.channels],
            }
        )

    def answer(self, message: Mapping[str, Any]) -> None:
        """Do what a message asks; whatever the machine's code does, the answer says it.

        Args:
            message: `plan` or `run`.
        """
        trial = str(message.get("trial", ""))
        try:
            x = protocol.decode(message.get("x"))
            if message.get("do") == "plan":
                self.say({"say": "planned", "trial": trial, **self._plan_of(x)})
            elif message.get("do") == "run":
                self.say(self._run(trial, x, float(message.get("seconds", 0.0))))
            else:
                raise ValueError(f"a host does plan, run, beat and close, not {message.get('do')!r}")
        except Exception as error:  # noqa: BLE001 - a driver may raise anything; nothing has moved
            self.say({"say": "refused", "trial": trial, "reason": _reason_of(error)})

    def close(self) -> None:
        """Come to rest, and let go of the robot."""
        with suppress(Exception):
            self.machine.stop()
        with suppress(Exception):
            self.machine.close()
        self._stop_listening()

    def _plan_of(self, x: "tuple[float, ...]") -> "dict[str, Any]":
        plan = self.machine.plan(x)
        found = first_objection(LimitWatch(self.limits, plan.channels, plan.period), plan.rows)
        if not found and plan.seconds > self.limits.duration:
            found = f"a trial must take at most {self.limits.duration:g} s, and this takes {plan.seconds:g}"
        return {
            "seconds": plan.seconds,
            "steps": len(plan.rows),
            "channels": [] if found else list(plan.extremes(self.limits)),
            "objection": found,
        }

    def _run(self, trial: str, x: "tuple[float, ...]", seconds: float) -> "dict[str, Any]":
        """Move the robot once; the ledger knows it before anything moves, and what became of it."""
        plan = self._plan_of(x)
        found = plan["objection"] or self._not_yet(trial)
        if found:
            return {"say": "refused", "trial": trial, "reason": found}
        channels = self.machine.channels
        names, units = [each.name for each in channels], [each.unit for each in channels]
        self._under_way = {"trial": trial, "steps": plan["steps"], "names": names, "units": units}
        self.machine.folder = folder = make_folder(self.home.trials, trial)
        ledger = self.home.ledger
        self.guard.deadline = now() + min(seconds, self.limits.duration)
        self.guard.beat = now()
        watch = LimitWatch(self.limits, self.machine.channels, self.machine.period)
        ledger.append(STARTED, {"trial": trial, "x": hashlib.sha256(protocol.encode(x).encode()).hexdigest()})
        self.say({"say": "started", "trial": trial})
        try:
            measured = motion.run(self.machine, x, watch, self.guard, self.pulse, self.period)
            _require_measurement(measured)
            facts = {"trial": trial, "measurement": measured, **self._commands()}
            ledger.append(ENDED, facts)
        except Exception as error:  # noqa: BLE001 - a driver may raise anything, and the robot may have moved
            what, reason = self._note_break(trial, *_meaning_of(error))
            return {"say": what, "trial": trial, "reason": reason}
        finally:
            self._record_commands(folder)
        return {"say": "ended", **facts}

    def _record_commands(self, folder: Path) -> None:
        """Keep what was sent; whatever goes wrong here must not change what became of the trial."""
        with suppress(Exception):
            began = self.pulse.sent[0][0] if self.pulse.sent else 0.0
            rows = ((at - began, *command) for at, *command in self.pulse.sent)
            write_table(folder / COMMANDS, ["seconds", *(each.name for each in self.machine.channels)], rows)

    def _note_break(self, trial: str, what: str, reason: str) -> "tuple[str, str]":
        """Tell the ledger how a motion ended; where it takes no more, nobody knows what the robot did."""
        try:
            facts = {"trial": trial, "what": what, "reason": reason, **self._commands()}
            self.home.ledger.append(BROKEN, facts)
        except Exception as error:  # noqa: BLE001 - once a trial has started, nothing may call it unmoved
            return "broke", f"{reason}; and the ledger could not be written: {error}"
        return what, reason

    def _not_yet(self, trial: str) -> str:
        """Why a trial must not start at all."""
        if self.home.latch.is_set:
            return str(self.home.latch.read())
        if self.guard.asked.is_set():
            return self.guard.why
        started = {e.facts.get("trial") for e in self.home.ledger.entries() if e.event == STARTED}
        if trial in started:
            return (
                f"trial {trial} has already moved the robot according to {self.home.ledger.path}; it is not "
                "run again: a repetition is a trial of its own"
            )
        return ""

    def _commands(self) -> "dict[str, Any]":
        pulse = self.pulse
        return {
            "commands": len(pulse.sent),
            "late": pulse.late,
            "last_command": pulse.last_command,
            "seconds": pulse.sent[-1][0] - pulse.sent[0][0] if pulse.sent else 0.0,
            "travel": travel(self.machine.channels, self.machine.period, pulse.sent),
        }

    def _give_up(self, found: str) -> None:
        """The driver hangs: leave, which the ledger and whoever drives this will notice."""
        reason = f"{found}; and the driver did not come to rest"
        with suppress(Exception):
            self.home.ledger.append(BROKEN, {"trial": "", "what": "hangs", "reason": reason})
        os._exit(4)


def serve(host: Host, lines: BinaryIO) -> None:
    """Answer messages until they end, or one says `close`.

    Args:
        host: that answers.
        lines: they come from here.
    """
    messages: queue.Queue[Mapping[str, Any]] = queue.Queue()

    def read() -> None:
        for line in iter(lines.readline, b""):
            try:
                message = protocol.message_of(line)
            except ValueError as error:
                message = {"do": "nothing", "reason": str(error)}
            host.guard.beat = now()
            if message.get("do") != "beat":
                messages.put(message)
        host.guard.stop("the process that drives the host is gone")
        messages.put({"do": "close"})

    threading.Thread(target=read, name="lines", daemon=True).start()
    host.greet()
    while (message := messages.get()).get("do") != "close":
        host.answer(message)


def _require_measurement(measured: Any) -> None:
    """Refuse what is no measurement before the ledger has it: nobody could read it again."""
    if not isinstance(measured, dict) or not {"f", "y", "evidence"} <= measured.keys():
        raise ValueError(f"`end` must return f, y, stop and evidence, got {measured!r:.200}")
    f, y = measured["f"], measured["y"]
    if not isinstance(f, (int, float)) or not math.isfinite(f):
        raise ValueError(f"the objective f must be finite, got {f!r}")
    if not isinstance(y, (int, float)) or not 0.0 <= y <= 1.0:
        raise ValueError(f"the badness y must lie in [0, 1], got {y!r}")
    if not re.fullmatch("[0-9a-f]{64}", str(measured["evidence"])):
        raise ValueError(f"evidence must be a SHA-256 in hexadecimal, got {measured['evidence']!r:.80}")


def _reason_of(error: Exception) -> str:
    """What was expected to go wrong says so by itself; all else by its kind, and its traceback in the log."""
    if isinstance(error, (ValueError, TypeError, OSError, LedgerDamaged, Fault)):
        return str(error)
    traceback.print_exc(file=sys.stderr)
    return _with_place(error)


def _meaning_of(error: Exception) -> "tuple[str, str]":
    """What an error means, and its reason."""
    if isinstance(error, Stopped):
        return "stopped", str(error)
    if isinstance(error, Fault):
        return "fault", str(error)
    traceback.print_exc(file=sys.stderr)
    return "broke", _with_place(error)


def _with_place(error: Exception) -> str:
    place = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{os.path.basename(place.filename)}, line {place.lineno}"  # noqa: PTH119 - a name, no path
    return f"{type(error).__name__}: {error} ({where})"
