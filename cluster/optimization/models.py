"""A trained model that a user names, by its folder or its file: the one place where one is loaded."""

from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

from cluster.errors import UserError
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc


class TrainedModel(NamedTuple):
    """A model in evaluation mode, the file it is from, and what else that holds."""

    path: Path
    model: SvaeDc
    metadata: dict[str, Any]


def load_model(path: Path | str) -> TrainedModel:
    """The model in a folder or file, whatever it was trained on; its parameters are frozen.

    `model.latent_means(x)` gives latent paths and badness of controllers.

    Raises:
        UserError: it cannot be read.
    """
    file = checkpoint.checkpoint_path(Path(path))
    try:
        model, metadata = checkpoint.load(file)
    except (FileNotFoundError, ValueError) as error:
        raise UserError(f"cannot use the model: {error}") from error
    return TrainedModel(file, model.requires_grad_(requires_grad=False), metadata)


def trained_model(path: Path, setup: str, twin: str = "") -> TrainedModel:
    """The model in a folder or file, its parameters frozen.

    Args:
        path: folder that `svaedc train` left, or the checkpoint in it.
        setup: that it must have been trained on.
        twin: another setup that will do as well; "" for none.

    Returns:
        The model, its file and its metadata.

    Raises:
        UserError: it cannot be read, or was trained on another setup.
    """
    found = load_model(path)
    trained_on = twin if twin and found.metadata.get("setup") == twin else setup
    try:
        checkpoint.require(found.path, found.metadata, {"setup": trained_on})
    except ValueError as error:
        raise UserError(f"cannot use the model: {error}") from error
    return found


@cache
def shared_model(path: Path, setup: str, twin: str = "") -> SvaeDc:
    """The same model, loaded once in a process, however many runs use it.

    Args:
        path: of the checkpoint.
        setup: that it must have been trained on.
        twin: another setup that will do as well; "" for none.

    Returns:
        The model alone.
    """
    return trained_model(path, setup, twin).model
