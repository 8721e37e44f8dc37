"""The user's home, which a container may lack: no HOME, a user without a name, or nothing that can be written."""

import os
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


def cache_folder() -> Path:
    """`~/.cache/svaedc`; where that cannot be made, a folder of this user's beside the temporary files."""
    elsewhere = Path(tempfile.gettempdir()) / f"svaedc-{os.getuid()}"
    try:
        usual = expand_home(Path("~/.cache/svaedc"))
    except ValueError:
        return elsewhere
    return usual if _is_writable(usual) else elsewhere


def _is_writable(folder: Path) -> bool:
    """Whether files can be made in a folder, which itself need not exist yet."""
    place = folder
    while not os.path.exists(place) and place != place.parent:  # noqa: PTH110 - Path.exists raises where denied
        place = place.parent
    return os.access(place, os.W_OK | os.X_OK)
