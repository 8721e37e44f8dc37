"""The errors that a command shows to its user, and the exit codes that scripts see."""

from collections.abc import Iterable
from difflib import get_close_matches
from enum import IntEnum
from typing import ClassVar


class ExitCode(IntEnum):
    """How a command ended.

    | code | name          | when                                                                            |
    |------|---------------|---------------------------------------------------------------------------------|
    | 0    | `DONE`        | it did what was asked, or all of that was done before                           |
    | 1    | `FAILED`      | something stands in the way, or was found wrong: the message says what to do    |
    | 2    | `USAGE`       | the command line or the settings ask for what does not exist; nothing was begun |
    | 130  | `INTERRUPTED` | Ctrl-C; what is finished is kept                                                |
    | 141  | `UNREAD`      | whoever read its output left before the end, as `head` does                     |
    | 143  | `TERMINATED`  | SIGTERM (`ray job stop`, a service manager); what is finished is kept           |

    Code 1 with a traceback is a mistake in this program. The system adds codes of its own: 137 is a process
    that was killed outright, most often because memory was short.
    """

    DONE = 0
    FAILED = 1
    USAGE = 2
    INTERRUPTED = 130
    UNREAD = 141
    TERMINATED = 143


class UserError(Exception):
    """Something outside the program stands in the way; the message says what, and what to do about it."""

    exit_code: ClassVar[ExitCode] = ExitCode.FAILED


class UsageError(UserError):
    """The command line or the settings ask for something that does not exist."""

    exit_code: ClassVar[ExitCode] = ExitCode.USAGE


def nearest(unknown: str, known: Iterable[str]) -> str:
    """Says which of the known names was probably meant.

    Args:
        unknown: the name as it was given.
        known: every name that would have been accepted.

    Returns:
        `did you mean 'stride'?`, or the whole list when nothing is near.
    """
    names = sorted(known)
    close = get_close_matches(unknown, names, n=1)
    return f"did you mean {close[0]!r}?" if close else f"known: {', '.join(names)}"
