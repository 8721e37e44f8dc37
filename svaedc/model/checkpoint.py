"""Model checkpoints: weights, sizes and origin in one file that runs no code when it is read."""

import os
import pickle
import zipfile
from pathlib import Path
from typing import Any, Final

import torch

from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc

FILE: Final = "model.pt"
"""A trained model's checkpoint has this name in its folder."""

FORMAT: Final = 1
CPU: Final = torch.device("cpu")


def save(path: Path, model: SvaeDc, metadata: dict[str, Any]) -> None:
    """Write `model` to `path`, all or nothing, replacing an older checkpoint only when complete.

    Args:
        path: File to write; its folder must exist.
        model: Its configuration and buffers go along, so the file is self-contained.
        metadata: Plain built-in values: setup, dataset fingerprint, stride, versions.
    """
    write(
        path,
        {
            "format": FORMAT,
            "config": model.config.to_dict(),
            "weights": model.state_dict(),
            "metadata": metadata,
        },
    )


def checkpoint_path(path: Path) -> Path:
    """The checkpoint that a user names by itself or by its folder."""
    return path / FILE if path.is_dir() else path


def load(path: Path, device: torch.device = CPU) -> tuple[SvaeDc, dict[str, Any]]:
    """Read a model and put it into evaluation mode.

    Args:
        path: File that `save` wrote.
        device: Where the weights go.

    Returns:
        The model and its metadata.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: The file is damaged, or not a checkpoint of this version.
    """
    content = read(path, device)
    if content.get("format") != FORMAT or not {"config", "weights", "metadata"} <= content.keys():
        raise ValueError(f"{path} is not a model checkpoint of format {FORMAT}; train the model again")
    model = SvaeDc(ModelConfig.from_dict(content["config"]))
    try:
        model.load_state_dict(content["weights"])
    except RuntimeError as error:
        raise ValueError(f"{path} holds weights that do not fit its own configuration: {error}") from error
    return model.to(device).eval(), content["metadata"]


def require(path: Path, found: dict[str, Any], expected: dict[str, Any]) -> None:
    """Refuse a checkpoint made for something else.

    Args:
        path: Named in the error.
        found: Its metadata and sizes.
        expected: Values it must have, for example `{"setup": "franka"}`.

    Raises:
        ValueError: A value differs; both are named.
    """
    for name, value in expected.items():
        if found.get(name) != value:
            raise ValueError(
                f"{path} was made for {name} {found.get(name)!r}, not {value!r}; "
                "name another checkpoint or train one"
            )


def write(path: Path, content: dict[str, Any]) -> None:
    """Write plain values and tensors to `path` atomically: temporary file, fsync, rename.

    Args:
        path: File to write; its folder must exist.
        content: What `torch.load(weights_only=True)` can read back.

    Raises:
        OSError: It cannot be written, for example on a full disk; an older file at `path` stays as it was.
    """
    temporary = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        with temporary.open("wb") as file:
            torch.save(content, file)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    except (OSError, RuntimeError) as error:
        # Torch hides what the file said behind an error of its own archive writer.
        cause = error if isinstance(error, OSError) else error.__context__
        if not isinstance(cause, OSError):
            raise
        raise OSError(cause.errno, f"cannot write a checkpoint: {cause.strerror}", str(path)) from error
    finally:
        temporary.unlink(missing_ok=True)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


def read(path: Path, device: torch.device = CPU) -> dict[str, Any]:
    """Read what `write` wrote; no code in the file is run.

    Args:
        path: File to read.
        device: Where tensors go.

    Returns:
        Plain values and tensors, by name.

    Raises:
        FileNotFoundError: There is no such file.
        ValueError: The file is damaged or holds other objects.
    """
    try:
        with path.open("rb") as file, zipfile.ZipFile(file) as archive:
            # Torch checks no sums: a flipped bit would come back as another weight.
            damaged = archive.testzip()
        if damaged is not None:
            raise ValueError(f"the checksum of {damaged} is wrong")
        content = torch.load(path, map_location=device, weights_only=True)
    except (
        zipfile.BadZipFile,
        RuntimeError,
        EOFError,
        pickle.UnpicklingError,
        KeyError,
        ValueError,
    ) as error:
        raise ValueError(f"{path} is damaged or not a checkpoint; restore it or train again") from error
    if not isinstance(content, dict):
        raise ValueError(f"{path} must hold a dictionary, found {type(content).__name__}; train again")
    return content
