"""The way of a stop: from anybody on the robot's machine straight to its host, past everything else."""

import json
import os
import socket
import threading
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from workers.host.guard import Guard
from workers.host.home import RobotHome
from workers.host.latch import Stop
from workers.host.motion import Pulse

PATIENCE_SECONDS = 2.0
_LONGEST = 4096  # bytes of a request or an answer


@dataclass(frozen=True)
class Answer:
    """What became of a stop.

    Attributes:
        reached: whether a host answered.
        moving: whether a motion was under way.
        at_rest: whether the driver brought the robot to rest.
        last_command: when the host sent its last command, in s of `guard.now`; 0 for none.
        rest: what the robot's motors do after a stop, as its driver declares.
        pid: of the host; 0 where none answered.
        first: whether the robot was not stopped before, as far as its latch could be read.
    """

    reached: bool
    moving: bool = False
    at_rest: bool = False
    last_command: float = 0.0
    rest: str = ""
    pid: int = 0
    first: bool = True


def request(home: RobotHome, stop: Stop, patience: float = PATIENCE_SECONDS) -> Answer:
    """Stop a robot: set its latch, then tell its host, which needs neither Ray nor the campaign's process.

    The disk is waited for last: the host need not be.

    Args:
        home: of the robot.
        stop: who and why.
        patience: s that the host has to answer.

    Returns:
        What the host said; not `reached` where there is none, or where it hangs. The latch is set anyway.

    Raises:
        OSError: the latch could not be written for good, and no host answered.
    """
    trouble: OSError | None = None
    first = True
    try:
        first = home.latch.set(stop)
    except OSError as error:
        trouble = error
    answer = _ask_host(home.socket, stop, patience)
    try:
        home.latch.keep()
    except OSError as error:
        trouble = trouble or error
    if trouble is not None and not answer.reached:
        raise trouble
    return replace(answer, first=first)


def _ask_host(path: Path, stop: Stop, patience: float) -> Answer:
    with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
        connection.settimeout(patience)
        try:
            connection.connect(os.fspath(path))
            connection.sendall(json.dumps({"who": stop.who, "reason": stop.reason}).encode() + b"\n")
            connection.shutdown(socket.SHUT_WR)
            return Answer(reached=True, **json.loads(connection.recv(_LONGEST)))
        except (OSError, ValueError, TypeError):
            return Answer(reached=False)


def listen(
    home: RobotHome, guard: Guard, pulse: Pulse, facts: Callable[[], dict[str, Any]]
) -> Callable[[], None]:
    """Answer stops from now on, in a thread of its own.

    Args:
        home: of the robot.
        guard: is told of every stop.
        pulse: of the motion.
        facts: what the answer says of the host.

    Returns:
        A function that ends it.

    Raises:
        OSError: the socket cannot be made.
    """
    path = home.socket
    path.unlink(missing_ok=True)  # of a host that was killed; the home is held, so no other lives
    server = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    server.bind(os.fspath(path))
    server.listen(16)
    answering = threading.Lock()

    def serve() -> None:
        while True:
            try:
                connection, _ = server.accept()
            except OSError:
                return
            with answering, connection, suppress(OSError, ValueError, TypeError, KeyError):
                _answer(connection, guard, pulse, facts)

    threading.Thread(target=serve, name="stop", daemon=True).start()

    def close() -> None:
        server.close()
        path.unlink(missing_ok=True)
        # Whoever asked for a stop gets the answer before the process ends.
        if answering.acquire(timeout=PATIENCE_SECONDS):
            answering.release()

    return close


def _answer(
    connection: socket.socket, guard: Guard, pulse: Pulse, facts: Callable[[], dict[str, Any]]
) -> None:
    connection.settimeout(_READ_SECONDS)
    was_moving = pulse.moving
    guard.stop("a stop was asked for")  # whatever the request says: a stop that cannot be read is one as well
    with suppress(OSError, ValueError, TypeError, KeyError):
        asked = json.loads(connection.recv(_LONGEST))
        guard.why = str(Stop(str(asked["who"]), str(asked["reason"])))
    if was_moving:
        pulse.over.wait(_REST_SECONDS)
    answer = {"moving": was_moving, "at_rest": pulse.at_rest, "last_command": pulse.last_command, **facts()}
    connection.sendall(json.dumps(answer).encode() + b"\n")


_READ_SECONDS = 0.2
_REST_SECONDS = 1.5
