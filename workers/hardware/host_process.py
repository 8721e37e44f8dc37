"""The child process in which a robot's host lives: started, spoken to, and ended."""

import json
import os
import select
import subprocess
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any, Final

from workers import host
from workers.hardware.driver import RobotFault
from workers.host import protocol
from workers.host.home import RobotHome

START_SECONDS: Final = 120.0
"""A host says hello within this; loading a simulation takes a while on a busy machine."""
LEAVE_SECONDS: Final = 2.0
"""A host that is told to leave is gone after this, or is killed where that brings the motors to rest."""
HARMLESS_TO_KILL: Final = frozenset({"hold", "sag"})
"""Where a robot's motors do this without their host, one that hangs may be killed."""


@dataclass(frozen=True)
class Machinery:
    """How the host of a robot is started.

    Attributes:
        machine: `module:name` of a subclass of `workers.host.machine.RobotMachine`.
        python: interpreter of the environment that its driver is installed in.
        settings: keyword arguments of the machine.
        simulated: whether it may take as long as it needs.
    """

    machine: str
    python: str = sys.executable
    settings: Mapping[str, Any] = field(default_factory=dict)
    simulated: bool = False


class HostProcess:
    """The child process; it ends with `leave`.

    Args:
        home: of the robot.
        machinery: how it is started.
        settings: that it is given, plain values.

    Attributes:
        hello: what it said of itself.

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
        self._heard = b""
        self.hello: Mapping[str, Any] = {}
        self._wait_for_greeting(home)

    def _wait_for_greeting(self, home: RobotHome) -> None:
        try:
            self.hello = self.listen(START_SECONDS)
        except (OSError, EOFError, ValueError) as error:
            self._process.kill()
            self.leave()
            raise RobotFault(
                f"the process at {home.robot} does not start ({self.end}); see {home.log}"
            ) from error
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

    def listen(self, seconds: float) -> Mapping[str, Any]:
        """Wait for the next message.

        Args:
            seconds: that it may take.

        Returns:
            The message.

        Raises:
            EOFError: there will be none.
            TimeoutError: there was none in time.
            ValueError: it cannot be read.
        """
        pipe, deadline = _pipe(self._process.stdout), time.monotonic() + seconds
        while b"\n" not in self._heard:
            if not select.select([pipe], [], [], max(0.0, deadline - time.monotonic()))[0]:
                raise TimeoutError(f"no answer for {seconds:.0f} s")
            heard = os.read(pipe.fileno(), 65536)
            if not heard:
                raise EOFError("its answers have ended")
            self._heard += heard
        line, _, self._heard = self._heard.partition(b"\n")
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
        """Let the process come to rest and end; kill it where it does not, and where that does no harm."""
        with suppress(OSError, ValueError):
            _pipe(self._process.stdin).close()
        try:
            self._process.wait(LEAVE_SECONDS)
        except subprocess.TimeoutExpired:
            if self.hello.get("rest", {}).get("kill") in HARMLESS_TO_KILL:
                self._process.kill()
                self._process.wait()
        _pipe(self._process.stdout).close()


def _pipe(pipe: IO[bytes] | None) -> IO[bytes]:
    if pipe is None:
        raise OSError("the process at the robot has no pipe")
    return pipe
