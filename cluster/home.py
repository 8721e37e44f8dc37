"""The user's home, which a container may lack: no HOME, a user without a name, or a read-only one."""

import os
import re
import tempfile
from pathlib import Path


def expand_home(path: Path) -> Path:
    """The path, in which a leading `~` stands for the user's home.

    Raises:
        ValueError: nobody knows where that is.
    """
    try:
        return path.expanduser()
    except RuntimeError as error:
        raise ValueError(
            f"{path} begins with a home that is not known here: set HOME, or give an absolute path"
        ) from error


def require_home() -> None:
    """Let libraries have a home where the system knows of none: MLflow cannot even be imported without.

    It is a folder of this user's beside the temporary files, also for the processes that are started later.
    """
    try:
        Path.home()
    except RuntimeError:
        home = _substitute()
        home.mkdir(mode=0o700, exist_ok=True)
        if home.stat().st_uid != os.getuid():  # somebody else was here first
            home = Path(tempfile.mkdtemp(prefix="svaedc-"))
        os.environ["HOME"] = str(home)


SHARED_STATE = Path("/var/lib/svaedc")
"""What all users of a machine share lies here, where there is such a folder."""


def robot_folder(robot: str) -> Path:
    """The home of a robot: that which all users share, if there is one; else this user's.

    Args:
        robot: its name.

    Returns:
        A folder, which need not exist.

    Raises:
        ValueError: nobody knows where the user's home is.
    """
    name = re.sub(r"[^\w.-]", "-", robot)
    shared = SHARED_STATE / "robots" / name
    if shared.is_dir():
        return shared
    state = os.environ.get("XDG_STATE_HOME") or "~/.local/state"
    return expand_home(Path(state)) / "svaedc" / "robots" / name


def cache_folder() -> Path:
    """`~/.cache/svaedc`; where that cannot be made, a folder of this user's beside the temporary files."""
    try:
        usual = expand_home(Path("~/.cache/svaedc"))
    except ValueError:
        return _substitute()
    return usual if is_writable(usual) else _substitute()


def _substitute() -> Path:
    return Path(tempfile.gettempdir()) / f"svaedc-{os.getuid()}"


def is_writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which itself need not exist yet."""
    place = folder
    while not os.path.exists(place) and place != place.parent:  # noqa: PTH110 - Path.exists raises where denied
        place = place.parent
    return os.access(place, os.W_OK | os.X_OK)
