"""Exit codes: one enumeration, the same table in its docstring and in the documentation."""

import re
import signal
from pathlib import Path

from cluster.errors import ExitCode, UsageError, UserError

TABLE = Path(__file__).parents[2] / "docs" / "reference" / "exit-codes.md"
ROW = re.compile(r"^\s*\| (\d+) +\| `([A-Z]+)`", re.MULTILINE)


def test_the_docstring_and_the_documentation_hold_every_code():
    every = {str(code.value): code.name for code in ExitCode}
    assert dict(ROW.findall(ExitCode.__doc__)) == every
    assert dict(ROW.findall(TABLE.read_text(encoding="utf-8"))) == every


def test_codes_of_signals_are_those_of_a_shell():
    assert ExitCode.INTERRUPTED == 128 + signal.SIGINT
    assert ExitCode.TERMINATED == 128 + signal.SIGTERM
    assert ExitCode.UNREAD == 128 + signal.SIGPIPE


def test_errors_end_commands_with_codes_of_the_table():
    assert (UserError.exit_code, UsageError.exit_code) == (ExitCode.FAILED, ExitCode.USAGE)
