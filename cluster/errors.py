"""The errors that a command shows to its user: one message, no traceback, and an exit code."""

from collections.abc import Iterable
from difflib import get_close_matches
from typing import ClassVar


class UserError(Exception):
    """Something outside the program stands in the way; the message says what, and what to do about it."""

    exit_code: ClassVar[int] = 1


class UsageError(UserError):
    """The command line or the settings ask for something that does not exist."""

    exit_code: ClassVar[int] = 2


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
