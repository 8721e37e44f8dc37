"""Where something was raised: type, message, file and line, for the author of the code to find the place."""

import sysconfig
import traceback
from collections.abc import Sequence
from pathlib import Path
from traceback import FrameSummary

_PROJECT = tuple(Path(__file__).parents[1] / name for name in ("workers", "svaedc", "cluster"))
_LIBRARIES = tuple(Path(sysconfig.get_path(name)) for name in ("stdlib", "platstdlib", "purelib", "platlib"))
_GENERATED = "<string>"  # the file of what Python writes itself, such as the __init__ of a dataclass
_LONGEST = 300
"""A message is cut after so many characters where it has to fit one line."""


class UserCodeError(ValueError):
    """A user's module, or what it gives, is not as it must be."""


def describe(error: BaseException) -> str:
    """Tell an error in one line: its type and message, and where the user's own code raised it.

    The place is the innermost line of a file that is neither this project's nor a library's. Where there is
    none, it is the innermost line of all.
    """
    kind, message = type(error).__name__, _one_line(str(error))
    if isinstance(error, SyntaxError) and error.filename:
        return f"{kind}: {_one_line(error.msg)}, at {_short(error.filename)}:{error.lineno}"
    told = f"{kind}: {message}" if message else kind
    frames = traceback.extract_tb(error.__traceback__)
    if not frames:
        return told
    frame = _own_frame(frames)
    line = f": {frame.line}" if frame.line else ""
    return f"{told}, at {_short(frame.filename)}:{frame.lineno} in {frame.name}{line}"


def full_traceback(error: BaseException) -> str:
    """The whole traceback, as Python prints it."""
    return "".join(traceback.format_exception(error))


def _own_frame(frames: Sequence[FrameSummary]) -> FrameSummary:
    foreign = [
        frame for frame in frames if frame.filename != _GENERATED and not _is_in(frame.filename, _PROJECT)
    ]
    own = [frame for frame in foreign if not _is_in(frame.filename, _LIBRARIES)]
    if own:
        return own[-1]
    return foreign[0] if foreign else frames[-1]  # a plug-in is installed among the libraries


def _is_in(filename: str, folders: Sequence[Path]) -> bool:
    path = Path(filename)
    return any(path.is_relative_to(folder) for folder in folders) or filename.startswith("<frozen")


def _short(filename: str) -> str:
    """Relative to the working directory where the file lies below it."""
    path = Path(filename)
    here = Path.cwd()
    return str(path.relative_to(here)) if path.is_relative_to(here) else filename


def _one_line(message: str) -> str:
    text = " ".join(message.split())
    return text if len(text) <= _LONGEST else text[: _LONGEST - 1] + "…"
