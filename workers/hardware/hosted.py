"""A robot behind its host: a child process that is asked for one motion at a time, and the robot's ledger."""

import json
import math
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Final

import numpy as np
from jaxtyping import Float

from workers import host
from workers.hardware.driver import Measurement, Motion, RobotBroke, RobotFault, RobotStopped
from workers.host import protocol
from workers.host.guard import SILENCE_SECONDS
from workers.host.home import RobotHome
from workers.host.ledger import CUT, Ledger
from workers.host.limits import Limits
from workers.host.serve import BROKEN, ENDED, STARTED

START_SECONDS: Final = 120.0
"""A host says hello within this; loading a simulation takes a while on a busy machine."""
LEAVE_SECONDS: Final = 2.0
"""A host that is told to leave is gone after this, or is killed."""
_SLACK: Final = 2.0
_SIMULATED_SLACK: Final = 120.0
_SIMULATED_SILENCE: Final = 15.0  # s: a simulation that fills a busy machine is not stopped for it


@dataclass(frozen=True)
class Machinery:
    """How the host of a robot is started.

    Attributes:
        machine: `module:name` of a subclass of `workers.host.machine.Machine`.
        python: interpreter of the environment that its driver is installed in.
        settings: keyword arguments of the machine.
        simulated: whether it may take as long as it needs.
    """

    machine: str
    python: str = sys.executable
    settings: Mapping[str, Any] = field(default_factory=dict)
    simulated: bool = False


@dataclass(frozen=True)
class Planned:
    """What a controller will ask of the robot.

    Attributes:
        seconds: duration of the motion.
        steps: rows of the plan; 0 where the robot offers none.
        channels: name, kind, unit, lowest and highest value of each.
        objection: why it must not run; "" when it may.
    """

    seconds: float
    steps: int
    channels: tuple[Mapping[str, Any], ...]
    objection: str


class HostedRobot:
    """A robot that one process at a time drives; the host starts with the first question to it.

    Args:
        name: of the robot, as in the registry.
        setup: name of the setup it realises.
        home: of the robot, which the caller holds.
        machinery: how its host is started.
        limits: of the robot.
        period: s between two commands; None for the robot's own.
    """

    def __init__(
        self,
        name: str,
        setup: str,
        home: RobotHome,
        machinery: Machinery,
        limits: Limits,
        period: float | None = None,
    ) -> None:
        self.name = name
        self.setup = setup
        self.home = home
        self._machinery = machinery
        self._limits = limits
        self._period = period
        self._host: _Host | None = None

    @property
    def hello(self) -> Mapping[str, Any]:
        """What the host says of itself: rest, period, channels.

        Raises:
            RobotFault: it does not start.
        """
        return self._started().hello

    def check(self, trial_id: str, x: Float[np.ndarray, " D"]) -> Planned:
        """What a controller will ask of the robot; nothing moves.

        Args:
            trial_id: of the trial.
            x: the controller, [D], in [0, 1].

        Returns:
            The plan's extremes, or why it must not run.

        Raises:
            RobotFault: the host does not start, or does not answer.
        """
        answer = self._asked({"do": "plan", "trial": trial_id, "x": protocol.encode(x.tolist())})
        if answer["say"] != "planned":
            raise RobotFault(f"the plan of {trial_id} could not be made: {answer.get('reason')}")
        return Planned(
            answer["seconds"], answer["steps"], tuple(answer["channels"]), str(answer["objection"])
        )

    def run(self, trial_id: str, x: Float[np.ndarray, " D"]) -> Measurement:
        """Move the robot once; see `RobotDriver.run`.

        Args:
            trial_id: never seen by this robot before.
            x: the controller, [D], in [0, 1].

        Returns:
            What the trial measured.

        Raises:
            RobotFault: the robot broke off and stands still, or nothing moved.
            RobotStopped: the motion was stopped; the robot is at rest.
            RobotBroke: nobody knows what the robot did.
        """
        planned = self.check(trial_id, x)
        if planned.objection:
            raise RobotFault(f"trial {trial_id} was not started: {planned.objection}")
        began = time.monotonic()
        seconds = self._longest(planned)
        answer = self._asked(
            {"do": "run", "trial": trial_id, "x": protocol.encode(x.tolist()), "seconds": seconds}, trial_id
        )
        if answer["say"] == "ended":
            return _measurement(answer["measurement"], time.monotonic() - began)
        self.stop()  # whatever a host has gone through, the next trial gets a new one
        raise _ERRORS[answer["say"]](f"trial {trial_id}: {answer.get('reason')}")

    def stop(self) -> None:
        """End the host, which brings the robot to rest."""
        if self._host is not None:
            self._host.leave()
        self._host = None

    def motion(self, trial_id: str) -> Motion:
        """What the robot's ledger says of a trial."""
        return motion_in(self.home.ledger, trial_id)

    def _longest(self, planned: Planned) -> float:
        """The deadline of a trial, in s from its start."""
        own = float(self.hello["period"])
        stretched = planned.seconds * (self._period / own) if self._period else planned.seconds
        slack = _SIMULATED_SLACK if self._machinery.simulated else _SLACK
        return 1.2 * max(planned.seconds, stretched) + slack

    def _asked(self, message: Mapping[str, Any], trial_id: str = "") -> Mapping[str, Any]:
        """The host's answer; signs of life go to it until it has come."""
        started = self._started()
        try:
            with started.beating():
                started.tell(message)
                while (answer := started.listen())["say"] in ("started", "hello"):
                    pass
                return answer
        except (OSError, EOFError, ValueError) as error:
            self.stop()
            raise self._lost(started, trial_id, error) from error

    def _started(self) -> "_Host":
        if self._host is None:
            limits, period = self._limits.facts(), self._period
            silence = _SIMULATED_SILENCE if self._machinery.simulated else SILENCE_SECONDS
            settings = {"machine": dict(self._machinery.settings), "limits": limits, "silence": silence}
            if self._machinery.python == sys.executable:
                settings["path"] = [entry for entry in sys.path if entry]  # users' modules are found there
            self._host = _Host(
                self.home, self._machinery, settings if period is None else {**settings, "period": period}
            )
        return self._host

    def _lost(self, lost: "_Host", trial_id: str, error: Exception) -> RobotFault:
        """What is known once the host is gone: a trial it was running is unknown."""
        kill = lost.hello.get("rest", {}).get("kill", "what nobody declared")
        what = f"the process at {self.name} is gone ({lost.end}; {error}), see {self.home.log}"
        if trial_id and self.motion(trial_id).started:
            return RobotBroke(f"trial {trial_id}: {what}; without it its motors {kill}")
        return RobotFault(f"{what}; nothing was moved")


class _Host:
    """The child process.

    Raises:
        RobotFault: it does not start.
    """

    def __init__(self, home: RobotHome, machinery: Machinery, settings: Mapping[str, Any]) -> None:
        folder = Path(host.__file__).parent
        command = [machinery.python, "-u", str(folder), "--machine", machinery.machine]
        command += ["--home", str(home.path), "--robot", home.robot, "--settings", json.dumps(settings)]
        with home.log.open("ab") as log:
            try:
                self._process = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    stderr=log,
                    start_new_session=True,  # Ctrl-C at a terminal is for the driver to answer
                )
            except OSError as error:
                raise RobotFault(
                    f"cannot start the process at {home.robot} with {machinery.python}: {error}"
                ) from error
        self._lock = threading.Lock()
        self.hello: Mapping[str, Any] = {}
        self._greeted(home)

    def _greeted(self, home: RobotHome) -> None:
        timer = threading.Timer(START_SECONDS, self._process.kill)
        timer.start()
        try:
            self.hello = self.listen()
        except (EOFError, ValueError) as error:
            self.leave()
            raise RobotFault(
                f"the process at {home.robot} does not start ({self.end}); see {home.log}"
            ) from error
        finally:
            timer.cancel()
        if self.hello["say"] != "hello" or self.hello["protocol"] != protocol.VERSION:
            self.leave()
            raise RobotFault(
                f"the process at {home.robot} does not start: {self.hello.get('reason') or self.hello}"
            )
        home.write_host({"pid": self._process.pid, "rest": self.hello["rest"]})

    @property
    def end(self) -> str:
        """How the process ended, in words."""
        with suppress(subprocess.TimeoutExpired):
            self._process.wait(LEAVE_SECONDS)
        code = self._process.returncode
        if code is None:
            return "it hangs"
        return f"killed by signal {-code}" if code < 0 else f"exit status {code}"

    def tell(self, message: Mapping[str, Any]) -> None:
        """Send a message.

        Raises:
            OSError: nobody is there.
        """
        with self._lock:
            _pipe(self._process.stdin).write(protocol.line_of(message))
            _pipe(self._process.stdin).flush()

    def listen(self) -> Mapping[str, Any]:
        """Wait for the next message.

        Raises:
            EOFError: there will be none.
            ValueError: it cannot be read.
        """
        line = _pipe(self._process.stdout).readline()
        if not line:
            raise EOFError("its answers have ended")
        return protocol.message_of(line)

    @contextmanager
    def beating(self) -> Iterator[None]:
        """Send signs of life all the while."""
        over = threading.Event()

        def beat() -> None:
            while not over.wait(protocol.BEAT_SECONDS):
                try:
                    self.tell({"do": "beat"})
                except (OSError, ValueError):
                    return

        beater = threading.Thread(target=beat, name="signs of life", daemon=True)
        beater.start()
        try:
            yield
        finally:
            over.set()
            beater.join()

    def leave(self) -> None:
        """Let the process come to rest and end; kill it where it does not."""
        with suppress(OSError, ValueError):
            _pipe(self._process.stdin).close()
        try:
            self._process.wait(LEAVE_SECONDS)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        _pipe(self._process.stdout).close()


_ERRORS: Final[Mapping[str, type[RobotFault]]] = {
    "fault": RobotFault,
    "stopped": RobotStopped,
    "refused": RobotStopped,
    "broke": RobotBroke,
}


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    if pipe is None:
        raise OSError("the process at the robot has no pipe")
    return pipe


def _measurement(facts: Mapping[str, Any], seconds: float) -> Measurement:
    f = float(facts["f"])
    if not math.isfinite(f):
        raise RobotFault(f"the robot measured no objective, but {f}")
    evidence = str(facts["evidence"])
    return Measurement(
        f, float(facts["y"]), str(facts.get("stop", "")), float(facts.get("seconds", seconds)), evidence
    )


def motion_in(ledger: Ledger, trial_id: str) -> Motion:
    """What a robot's ledger says of one trial.

    Args:
        ledger: of the robot.
        trial_id: of the trial.

    Returns:
        Whether it moved the robot, and what it measured; not certain where a line that was cut off since the
        trial was granted may have been its start.
    """
    started, measured, certain = False, None, True
    for entry in ledger.entries():
        if entry.event == CUT:
            certain = False
        if entry.facts.get("trial") != trial_id:
            continue
        if entry.event not in (STARTED, ENDED, BROKEN):
            certain = True  # it was granted here, so that its start can only come later
            continue
        started = True
        if entry.event == ENDED:
            measured = _measurement(entry.facts["measurement"], 0.0)
    return Motion(started, measured, started or (certain and not ledger.is_cut))


def holder_facts(campaign: Path, machine: str) -> dict[str, Any]:
    """What others are told of the process that has a robot.

    Args:
        campaign: folder of the campaign.
        machine: name of the computer.

    Returns:
        Plain values.
    """
    return {"campaign": str(campaign), "pid": os.getpid(), "host": machine}
