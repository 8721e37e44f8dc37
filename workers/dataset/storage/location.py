"""Where a dataset lies: in a folder of this machine's file systems, or below a prefix of an object store."""

import os
from pathlib import Path
from typing import Any

from workers.dataset.storage.s3 import ObjectPath, object_path

Location = Path | ObjectPath
"""Both know `/`, `name`, `exists`, `iterdir`, `glob`, `read_bytes`, `read_text`, `unlink` and the like."""


def location(text: str) -> Location:
    """The place that a text names: `s3://bucket/prefix`, or a path.

    Raises:
        ValueError: it has a scheme, but is no address of an object store.
    """
    return object_path(text) if "://" in text else Path(text)


def files(folder: Location, pattern: str) -> list[Location]:
    """Look for the files directly in a folder whose names fit a pattern.

    Args:
        folder: which need not exist.
        pattern: of names, with `*` and `?`, without slashes.

    Returns:
        Their paths, in the order of their names.
    """
    return sorted(folder.glob(pattern), key=_name)


def _name(path: Location) -> str:
    return path.name


def fetch(path: Location) -> Location:
    """The same path, to be read several times: an object's bytes are asked for once."""
    return path if isinstance(path, Path) else path.fetch()


def source(path: Location) -> Any:
    """What PyArrow reads a file from, so that it need not fetch all of an object."""
    return arrow_name(path) if isinstance(path, Path) else path.open()


def arrow_name(path: Path) -> str:
    """A file's name as PyArrow takes it: UTF-8 even where the system's encoding is another (`LC_ALL=C`)."""
    return os.fsencode(path).decode("utf-8", "surrogateescape")
