"""The command line `svaedc`: the same on a laptop, against a cluster, and under `ray job submit`.

Commands import what they run when they run it, so that help and mistakes cost no time.
"""

import sys

import typer

from cluster.cli import dataset, hardware
from cluster.cli.check import check
from cluster.cli.collect import collect
from cluster.cli.compare import compare
from cluster.cli.demo import demo
from cluster.cli.render import render
from cluster.cli.reproduce import reproduce
from cluster.cli.train import train
from cluster.cli.ui import ui
from cluster.errors import UserError
from cluster.progress import say

app = typer.Typer(
    name="svaedc",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Learn robot controllers in ten trials: simulate many, learn a latent space of their trajectories "
    "that is compressed where they behave badly, and run Bayesian optimisation there.\n\n"
    "A first look: `svaedc demo`. The steps on their own: `check`, `collect`, `train`, `compare`, "
    "`hardware`; `render` shows an episode, `reproduce` makes a figure of the paper. "
    "Every long command may be interrupted and started again: it goes on where it was.",
)


for _command in (demo, check, collect, train, compare, ui, render, reproduce):
    app.command()(_command)
app.add_typer(dataset.app, name="dataset")
app.add_typer(hardware.app, name="hardware")


def main() -> None:
    """Run a command; a user's mistake becomes one line and an exit code, never a traceback."""
    try:
        app()
    except UserError as error:
        say(f"error: {error}")
        sys.exit(error.exit_code)
    except OSError as error:
        say(f"error: {error.strerror or error}{f': {error.filename}' if error.filename else ''}")
        sys.exit(UserError.exit_code)
