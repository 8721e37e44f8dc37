"""What is true of a robot whatever campaigns there are, and its stop."""

from typing import Annotated

import typer

from cluster.cli.hardware.arguments import Home, Note, RobotName, Who
from cluster.progress import say


def stop(
    robot: RobotName,
    who: Annotated[str, typer.Option("--who", help="Your name.")] = "somebody",
    reason: Annotated[str, typer.Option("--reason", help="Why.")] = "asked for",
    home: Home = None,
) -> None:
    """Stop a robot, whatever else hangs. NO SAFETY FUNCTION: a robot needs an emergency stop of its own."""
    from cluster.hardware.robot import stopping

    found = stopping.stop(robot, home, who, reason)
    say(found.advice)


def clear(robot: RobotName, who: Who, note: Note, home: Home = None) -> None:
    """Let a stopped robot move again, once you have seen that it stands still and is reset."""
    from cluster.hardware.robot import stopping

    why = stopping.clear(robot, home, who, note)
    say(f"{robot} may move again; it had been {why}" if why else f"{robot} was not stopped")


def robot(name: RobotName, home: Home = None) -> None:
    """What is true of a robot here: who has it, whether it is stopped, what it has gone through."""
    from cluster.hardware.robot.account import account

    for line in account(name, home):
        say(line)
