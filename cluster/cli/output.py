"""What commands print: whole lines, in whatever encoding, for a reader who may leave before the end."""

import os
import select
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

import typer

if TYPE_CHECKING:
    from rich.table import Table


def show(table: "Table") -> None:
    """Print a table with whole lines: nothing is cut or folded where a terminal is narrow, or is none."""
    from rich.console import Console
    from rich.measure import Measurement

    console = Console()
    natural = Measurement.get(console, console.options.update(max_width=sys.maxsize), table).maximum
    console.width = max(natural, console.width)
    with console.capture() as lines:
        console.print(table)
    for line in lines.get().splitlines():
        typer.echo(line.rstrip())


def write_any_character() -> None:
    """Let standard output write what its encoding lacks (`LC_ALL=C`) as an escape, as errors are written."""
    with suppress(AttributeError):  # none, or one of a test's own
        sys.stdout.reconfigure(errors="backslashreplace")  # type: ignore[union-attr]


class Reader:
    """Whoever reads standard output; `head` leaves when it has enough.

    Rich and typer point standard output elsewhere when that happens, so it is remembered here as it was.
    """

    def __init__(self) -> None:
        self._poll = select.poll()
        with suppress(AttributeError, OSError, ValueError):  # none, closed, or one of a test's own
            self._poll.register(os.dup(sys.stdout.fileno()), 0)

    def has_left(self) -> bool:
        """Whether nothing that is written is read any more."""
        return any(event & select.POLLERR for _, event in self._poll.poll(0))


def finish_writing() -> None:
    """Write what is left to standard output; without a reader it vanishes, or Python would complain.

    Raises:
        BrokenPipeError: the reader has left.
    """
    if sys.stdout is None:  # closed by whoever started this
        return
    try:
        sys.stdout.flush()
    except BrokenPipeError:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
        raise
