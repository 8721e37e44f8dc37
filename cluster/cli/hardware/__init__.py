"""`svaedc hardware`: campaigns on one robot, and what a person decides in them."""

import typer

from cluster.cli.hardware.carry_out import start, status
from cluster.cli.hardware.console import console, token
from cluster.cli.hardware.decide import adopt, amend, approve, reject, resolve, withdraw
from cluster.cli.hardware.record import attach, export, report
from cluster.cli.hardware.robot import clear, robot, stop

app = typer.Typer(
    no_args_is_help=True,
    help="Spend a few precious trials on one robot. Every trial is in a durable journal before it starts and "
    "after it ends; whatever dies, the same `start` command goes on, and no trial runs twice.",
)

for _command in (
    start, status, stop, clear, robot, approve, withdraw, reject, resolve, amend, adopt,
    attach, report, export, console, token,
):  # fmt: skip
    app.command()(_command)
