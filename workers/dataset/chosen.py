"""Controllers that were chosen, in a file beside a dataset's manifest: its first ones, before those drawn."""

import hashlib
import io
from typing import Final

import numpy as np
from jaxtyping import Float32

from workers.dataset.storage.atomic import link, synchronise, temporary_file
from workers.dataset.storage.location import Location

CHOSEN: Final = "controllers.npy"


def chosen_bytes(controllers: Float32[np.ndarray, "c d"]) -> bytes:
    """The content of the file."""
    buffer = io.BytesIO()
    np.save(buffer, controllers, allow_pickle=False)
    return buffer.getvalue()


def chosen_digest(controllers: Float32[np.ndarray, "c d"]) -> str:
    """SHA-256 of the file: what the identity of its dataset says of it."""
    return hashlib.sha256(chosen_bytes(controllers)).hexdigest()


def write_chosen(folder: Location, controllers: Float32[np.ndarray, "c d"]) -> None:
    """Write the file unless there is one.

    Args:
        folder: of the dataset; it must exist.
        controllers: in the unit cube, [c, D].
    """
    with temporary_file(folder, CHOSEN) as temporary:
        temporary.write_bytes(chosen_bytes(controllers))
        synchronise(temporary)
        link(temporary, folder / CHOSEN)


def read_chosen(folder: Location, digest: str) -> Float32[np.ndarray, "c d"]:
    """Read the file.

    Args:
        folder: of the dataset.
        digest: that its identity states.

    Returns:
        The controllers, in order, [c, D].

    Raises:
        ValueError: it is missing, or has other bytes.
    """
    path = folder / CHOSEN
    content = path.read_bytes() if path.exists() else b""
    if hashlib.sha256(content).hexdigest() != digest:
        found = "has changed" if content else "is missing"
        raise ValueError(
            f"{path} {found}: the first controllers of this dataset are in a file with the SHA-256 "
            f"{digest[:12]}…; the command that began the dataset writes it into another folder"
        )
    return np.load(io.BytesIO(content), allow_pickle=False)
