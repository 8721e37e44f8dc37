"""What commands print: whole lines, in any encoding, whoever reads it."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from rich.table import Table

from cluster.cli.output import show
from cluster.errors import ExitCode

COMMAND = str(Path(sys.executable).parent / "svaedc")


@pytest.mark.parametrize("columns", ["20", "40", "400"])
def test_no_line_is_cut_or_folded(columns, capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", columns)
    table = Table(show_header=False, box=None)
    table.add_row("fingerprint", "0123456789abcdef" * 4)
    table.add_row("made with", "several words " * 9)
    show(table)
    first, second = capsys.readouterr().out.splitlines()
    assert first.split() == ["fingerprint", "0123456789abcdef" * 4]
    assert second.split() == ["made", "with", *["several", "words"] * 9]


@pytest.mark.parametrize(
    ("arguments", "code"),
    [(["--version"], ExitCode.UNREAD), (["--help"], ExitCode.UNREAD), (["--absent"], ExitCode.USAGE)],
)
def test_a_reader_who_leaves_gets_no_traceback(arguments, code):
    """As `head` does; a mistake stays a mistake."""
    reading, writing = os.pipe()
    os.close(reading)
    done = subprocess.run([COMMAND, *arguments], stdout=writing, stderr=subprocess.PIPE, check=False)
    os.close(writing)
    assert done.returncode == code
    assert b"Traceback" not in done.stderr
    assert b"Broken" not in done.stderr


def test_a_closed_output_is_no_mistake():
    done = subprocess.run(f"{COMMAND} --version >&-", shell=True, stderr=subprocess.PIPE, check=False)
    assert (done.returncode, done.stderr) == (0, b"")


def test_letters_that_the_terminal_lacks_are_written_as_escapes():
    program = "from cluster.cli.output import write_any_character as go; go(); print('\\u03be of Z\\xfcrich')"
    environment = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0"}
    said = subprocess.check_output([sys.executable, "-c", program], env=environment)
    assert said == b"\\u03be of Z\\xfcrich\n"
