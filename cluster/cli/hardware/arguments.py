"""Arguments that the commands of `svaedc hardware` share."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.inputs import durable

Folder = Annotated[
    Path,
    typer.Argument(help="Folder of the campaign, on a local disk of the robot's machine.", callback=durable),
]
TrialNumber = Annotated[int, typer.Option("--trial", min=0, help="Its number, as `status` shows it.")]
Who = Annotated[str, typer.Option("--who", help="Your name; kept in the journal.")]
Note = Annotated[str, typer.Option("--note", help="What you saw, or why; kept in the journal.")]
RobotName = Annotated[str, typer.Argument(help="Which robot, as `svaedc robots` names it.")]
Home = Annotated[
    Path | None,
    typer.Option(
        "--home",
        help="Folder of all that is true of the robot; by default that in /var/lib/svaedc/robots, "
        "or else one in the user's state folder.",
        callback=durable,
    ),
]
Confirmed = Annotated[
    float | None,
    typer.Option("--confirm", help="The objective again, where it lies outside what the setup allows."),
]

AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        help="Print one JSON document, and nothing else, on standard output: campaign, robot, setup, method, "
        "seed, model, pool, approval, phase, measured, planned, best, advice, trials (number, state, kind, "
        "x, f, y), motion (what the trial that waits will do). What was not measured is null.",
    ),
]
