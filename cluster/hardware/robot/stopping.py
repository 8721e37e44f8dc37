"""`svaedc hardware stop` and `clear`: straight to the robot's host, past Ray, campaigns and drivers."""

import os
import signal
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

from cluster.errors import UsageError, UserError
from cluster.hardware.robot.residence import home_of, homes_of, robot_errors
from workers.hardware.gate import CLEARED
from workers.hardware.host_process import HARMLESS_TO_KILL
from workers.host import stop as way
from workers.host.home import RobotHome
from workers.host.latch import Stop
from workers.host.ledger import LedgerDamaged
from workers.host.stop import Answer

STOPPED = "stopped"
"""An event of the ledger: somebody stopped the robot."""


@dataclass(frozen=True)
class Stopping:
    """What a stop did.

    Attributes:
        answer: of the host.
        killed: whether a host that did not answer was killed.
        advice: for the person in charge.
        is_held: whether a process has the robot.
    """

    answer: Answer
    killed: bool
    advice: str
    is_held: bool


def stop(robot: str, home: Path | None, who: str, reason: str) -> Stopping:
    """Stop a robot, whatever else hangs: set its latch, tell its host, and kill that one where it must be.

    Args:
        robot: its name.
        home: folder that a person named; None for every home that it has here.
        who: stops it.
        reason: in words.

    Returns:
        What happened.

    Raises:
        UserError: the robot has no home here, or neither latch nor host could be reached.
    """
    homes = _existing(robot, home)
    with robot_errors(), ThreadPoolExecutor(len(homes)) as at_once:  # one that hangs must not delay another
        stops = list(at_once.map(lambda each: _stop_at(each, Stop(who, reason)), homes))
    first = max(stops, key=lambda each: (each.answer.reached, each.killed, each.is_held))
    others = [each for each in stops if each is not first and each.is_held]
    return replace(first, advice="\n".join(each.advice for each in (first, *others)))


def clear(robot: str, home: Path | None, who: str, note: str) -> str:
    """Let a stopped robot move again; for a person who stands at it.

    Args:
        robot: its name.
        home: folder that a person named; None for every home that it has here.
        who: has looked at the robot.
        note: what they saw.

    Returns:
        Why it had been stopped; "" when it was not.

    Raises:
        UsageError: nobody is named, or nothing was seen.
        UserError: the robot has no home here, or the ledger takes no more.
    """
    if not who.strip() or not note.strip():
        raise UsageError("a stop is cleared by a person who has seen the robot: give --who NAME --note TEXT")
    with robot_errors():
        stopped = [each for each in _existing(robot, home) if each.latch.is_set]
        reasons = [str(each.latch.read()) for each in stopped]
        for each, why in zip(stopped, reasons, strict=True):
            each.ledger.append(CLEARED, {"who": who.strip(), "note": note.strip(), "stop": why})
            each.latch.clear()
    return reasons[0] if reasons else ""


def _stop_at(home: RobotHome, asked: Stop) -> Stopping:
    answer = way.request(home, asked)
    killed = not answer.reached and _kill(home)
    if answer.first:
        _note(home, STOPPED, {"who": asked.who, "reason": asked.reason})
    return Stopping(answer, killed, _advice(home, answer, killed), bool(home.holder()))


def _existing(robot: str, home: Path | None) -> tuple[RobotHome, ...]:
    found = homes_of(robot, home)
    if not found:
        raise UserError(
            f"{home_of(robot, home).path} is no robot's home: no campaign of {robot} was ever begun with it "
            "here; name the robot as `svaedc robots` does, or its home with --home"
        )
    return found


def _kill(home: RobotHome) -> bool:
    """Kill a host that does not answer, where that brings the motors to rest."""
    host = home.read_host()
    if not home.holder() or host.get("rest", {}).get("kill") not in HARMLESS_TO_KILL:
        return False
    try:
        os.kill(int(host["pid"]), signal.SIGKILL)
    except (OSError, KeyError, ValueError):
        return False
    return True


def _note(home: RobotHome, event: str, facts: dict[str, str]) -> None:
    """The latch already holds; a ledger that cannot be written must not make a stop fail."""
    try:
        home.ledger.append(event, facts)
    except (OSError, LedgerDamaged):
        return


def _advice(home: RobotHome, answer: Answer, killed: bool) -> str:  # noqa: FBT001
    rest = home.read_host().get("rest", {})
    again = (
        f"It stays stopped until: svaedc hardware clear {home.robot} --home {home.path} "
        "--who NAME --note TEXT"
    )
    if answer.reached and not answer.at_rest:
        return f"the robot's driver could not stop it: USE THE ROBOT'S OWN EMERGENCY STOP. {again}"
    if answer.reached:
        return f"the robot's host has stopped; its motors {answer.rest}. {again}"
    if killed:
        return (
            f"the robot's host did not answer and was killed; without it its motors {rest['kill']}. {again}"
        )
    if not home.holder():
        return f"no host is at the robot, which gets no commands. {again}"
    return (
        "the robot's host did not answer, and its driver says that killing it lets the motors "
        f"{rest.get('kill', 'do what nobody declared')}: USE THE ROBOT'S OWN EMERGENCY STOP. {again}"
    )
