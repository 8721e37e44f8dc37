"""`svaedc check`: what is wrong with a robot, before many episodes are collected."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.options import Seed, SetupName
from cluster.inputs import durable, setup_of


def check(
    setup: SetupName,
    bad: Annotated[
        str,
        typer.Option("--bad", metavar="MODULE:FUNCTION", help="G_bad of your own instead of the setup's."),
    ] = "",
    seed: Seed = 0,
    timeout: Annotated[
        float, typer.Option("--timeout", min=0.1, help="Seconds after which an episode counts as hanging.")
    ] = 30.0,
    picture: Annotated[
        Path | None,
        typer.Option("--picture", help="Draw an episode into this file, .png or .gif.", callback=durable),
    ] = None,
) -> None:
    """Try a robot for about a minute, and say what is wrong with it and how to mend it.

    A few episodes are rolled out as `collect` does it, in a process of their own. Then it is checked that
    they come to their end within the bounds of their channels, that they are the same in another process and
    in another order, that commands fit the environment, that every parameter of physics and controller
    changes something, that objective and badness vary, and that Gymnasium and Ray take the robot. A *mistake*
    makes every episode useless; a *doubt* may be meant. With mistakes the exit code is 1.

    `svaedc check --setup franka`

    Your own robot, in `my_robot.py` of the working directory: `svaedc check --setup my_robot --picture
    robot.png`
    """
    from cluster.check import check as check_robot

    check_robot(setup_of(setup, bad), seed, timeout, picture)
