"""The command line `svaedc`: the same on a laptop, against a cluster, and under `ray job submit`.

Commands import what they run when they run it, so that help and mistakes cost no time.
"""

import sys
from typing import Annotated, Any

import typer
from typer.exceptions import TyperException

from cluster.cli import dataset, hardware, setups
from cluster.cli.check import check
from cluster.cli.collect import candidates, collect
from cluster.cli.compare import compare
from cluster.cli.demo import demo
from cluster.cli.listings import methods, robots
from cluster.cli.output import Reader, finish_writing, write_any_character
from cluster.cli.render import render
from cluster.cli.reproduce import reproduce
from cluster.cli.train import train
from cluster.cli.ui import ui
from cluster.errors import ExitCode, UserError
from cluster.progress import say

app = typer.Typer(
    name="svaedc",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode="markdown",
    help="Learn robot controllers in ten trials: simulate many, learn a latent space of their trajectories "
    "that is compressed where they behave badly, and run Bayesian optimisation there.\n\n"
    "A first look: `svaedc demo`. The steps on their own: `check`, `collect`, `train`, `candidates`, "
    "`compare`, `hardware`; `render` shows an episode, `reproduce` makes a figure of the paper; `setups`, "
    "`methods` and `robots` list what there is. "
    "Every long command may be interrupted and started again: it goes on where it was.",
)


for _command in (demo, check, collect, train, candidates, compare, ui, render, reproduce, methods, robots):
    app.command()(_command)
app.add_typer(dataset.app, name="dataset")
app.add_typer(hardware.app, name="hardware")
app.add_typer(setups.app, name="setups")


_COMPLETION = {
    "install_completion": "Let the Tab key complete commands and options in this shell.",
    "show_completion": "Print what that would add to the shell.",
}
"""Typer's own words for its options take several lines of the help."""


def _say_version(wanted: bool | None) -> None:  # noqa: FBT001 - typer calls it so
    if wanted:
        from importlib.metadata import version
        from platform import python_version

        typer.echo(f"svaedc {version('svaedc')}, Python {python_version()}")
        raise typer.Exit


@app.callback()
def _of_all_commands(
    _: Annotated[
        bool | None,
        typer.Option("--version", callback=_say_version, is_eager=True, help="Print it, and Python's."),
    ] = None,
) -> None:
    """What stands before a command; the help is that of `app`."""


def main() -> None:
    """Run a command; a user's mistake becomes one line and an exit code, never a traceback."""
    write_any_character()
    reader = Reader()
    try:
        code: object = _run()
    except SystemExit as end:
        code = end.code
        if code == ExitCode.FAILED and reader.has_left():
            code = ExitCode.UNREAD  # typer and rich end so
    try:
        finish_writing()
    except BrokenPipeError:
        code = code or ExitCode.UNREAD
    sys.exit(code)  # type: ignore[arg-type]


def _run() -> int:
    """The exit code of a command."""
    try:
        return _command_line()(standalone_mode=False) or ExitCode.DONE
    except TyperException as error:
        if error.format_message():  # not where the help has been printed
            say(f"error: {error.format_message()}{_remedy(error)}")
        return error.exit_code
    except UserError as error:
        say(f"error: {error}")
        return error.exit_code
    except OSError as error:
        say(f"error: {error.strerror or error}{f': {error.filename}' if error.filename else ''}")
        return ExitCode.FAILED


def _command_line() -> Any:
    """The command line as typer makes it, but for the help of two options."""
    command: Any = typer.main.get_command(app)
    for option in command.params:
        option.help = _COMPLETION.get(option.name, option.help)
    return command


def _remedy(error: TyperException) -> str:
    """Where a mistake on the command line is explained."""
    context = getattr(error, "ctx", None)
    return f" (`{context.command_path} --help` says what it takes)" if context else ""
