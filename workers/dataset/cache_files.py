"""The arrays of a training cache on disk: made in one folder, and opened only as they were made."""

import json
import zlib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

READY = "cache.json"
"""Its presence says that the arrays beside it are complete."""

Layout = Mapping[str, tuple[type[np.generic], tuple[int, ...]]]
"""It tells the type and shape of every array, by its name."""

_BLOCK = 1 << 20


def make(folder: Path, layout: Layout) -> dict[str, np.memmap]:
    """Make new memory-mapped arrays, to be filled and flushed.

    Args:
        folder: where their files go; it must exist.
        layout: of the arrays.

    Returns:
        The arrays by name, all zeros.
    """
    return {
        name: np.lib.format.open_memmap(_path(folder, name), mode="w+", dtype=kind, shape=shape)
        for name, (kind, shape) in layout.items()
    }


def finish(folder: Path, layout: Layout, facts: Mapping[str, int]) -> None:
    """Say that the arrays are complete, in a file with their checksums.

    Args:
        folder: of the arrays.
        layout: of the arrays.
        facts: what the file also says, `episodes` for their number among it.
    """
    checksums = {name: _checksum(_path(folder, name)) for name in layout}
    (folder / READY).write_text(json.dumps({**facts, "crc32": checksums}) + "\n", encoding="utf-8")


def is_finished(folder: Path) -> bool:
    """Whether a folder holds complete arrays."""
    return (folder / READY).exists()


def open_arrays(folder: Path, layout_of: Callable[[int], Layout]) -> dict[str, np.ndarray]:
    """Map the arrays into memory, to be read, once they are found to be those that were made.

    Every byte is checked against its file's CRC-32; of a cache from before there were checksums, types and
    shapes alone.

    Args:
        folder: of a finished cache.
        layout_of: from the number of episodes to the layout.

    Returns:
        The arrays by name.

    Raises:
        ValueError: an array is damaged or missing; the message says what to delete.
    """
    try:
        facts = json.loads((folder / READY).read_text(encoding="utf-8"))
        layout, checksums = layout_of(facts["episodes"]), facts.get("crc32", {})
        return {name: _open_array(_path(folder, name), *layout[name], checksums.get(name)) for name in layout}
    except (OSError, EOFError, ValueError, LookupError, TypeError, AttributeError) as error:
        raise ValueError(
            f"the training cache {folder} is damaged: {error}; delete that folder, and the dataset is "
            "decoded again"
        ) from error


def _open_array(path: Path, kind: type[np.generic], shape: tuple[int, ...], checksum: Any) -> np.ndarray:
    if checksum is not None and _checksum(path) != checksum:
        raise ValueError(f"the bytes of {path.name} are not those of its checksum in {READY}")
    array = np.load(path, mmap_mode="r")
    if array.dtype != kind or array.shape != shape:
        raise ValueError(f"{path.name} must hold {np.dtype(kind)} {shape}, got {array.dtype} {array.shape}")
    return array


def _checksum(path: Path) -> int:
    """CRC-32 of a file: enough against accidents, at a fraction of the time of a digest."""
    value = 0
    with path.open("rb") as file:
        while block := file.read(_BLOCK):
            value = zlib.crc32(block, value)
    return value


def _path(folder: Path, name: str) -> Path:
    return folder / f"{name}.npy"
