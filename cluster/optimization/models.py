"""A trained model that a user names, by its folder or its file: the one place where one is loaded."""

from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

from cluster.errors import UserError
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from workers.setups import load
from workers.setups.declared import changes, declaration, list_changes


def let_read_plans(model: SvaeDc, setup: str) -> SvaeDc:
    """Let a model whose p(tau, psi|x) reads plans have those of its robot; others stay as they are.

    Args:
        model: of any kind.
        setup: name of the one whose controllers it knows.

    Returns:
        The same model.

    Raises:
        UserError: there is no such setup here, or its controllers offer no plan of this size.
    """
    if not model.reads_plans:
        return model
    try:
        found = load(setup)
    except LookupError as error:
        raise UserError(f"cannot use the model, which reads plans of {setup!r}: {error.args[0]}") from error
    planned = len(found.controller.planned)
    if planned != model.config.plan_channels:
        raise UserError(
            f"cannot use the model: it reads plans of {model.config.plan_channels} channels, those of "
            f"{setup} have {planned}; train one anew"
        )
    model.read_plans(partial(found.plans, samples=model.config.plan_steps))
    return model


class TrainedModel(NamedTuple):
    """A model in evaluation mode, the file it is from, and what else that holds."""

    path: Path
    model: SvaeDc
    metadata: dict[str, Any]


def load_model(path: Path | str) -> TrainedModel:
    """The model in a folder or file, whatever it was trained on; its parameters are frozen.

    `model.latent_means(x)` gives latent paths and badness of controllers.

    Raises:
        UserError: it cannot be read, or reads plans of a setup that is not here.
    """
    file = checkpoint.checkpoint_path(Path(path))
    try:
        model, metadata = checkpoint.load(file)
    except (FileNotFoundError, ValueError) as error:
        raise UserError(f"cannot use the model: {error}") from error
    let_read_plans(model, str(metadata.get("setup")))
    return TrainedModel(file, model.requires_grad_(requires_grad=False), metadata)


def trained_model(path: Path, setup: str, twin: str = "") -> TrainedModel:
    """The model in a folder or file, its parameters frozen.

    Args:
        path: folder that `svaedc train` left, or the checkpoint in it.
        setup: that it must have been trained on, or one with the same controllers and channels: the same
            robot in another engine.
        twin: another setup that will do as well; "" for none.

    Returns:
        The model, its file and its metadata.

    Raises:
        UserError: it cannot be read, or was trained on a setup that differs in controllers or channels.
    """
    found = load_model(path)
    trained_on = str(found.metadata.get("setup"))
    if trained_on not in (setup, twin):
        differing = _differing(trained_on, setup)
        if differing:
            raise UserError(
                f"cannot use the model: {found.path} was made for setup {trained_on!r}, not {setup!r}, which "
                f"differs in {differing}; name another checkpoint or train one"
            )
    return found


def _differing(one: str, other: str) -> str:
    """In what two setups differ of what a model knows; "" where it can serve both."""
    try:
        known, asked = (
            {name: value for name, value in declaration(load(setup)).items() if name in _KNOWN}
            for setup in (one, other)
        )
    except LookupError as error:
        return f"all that is known: {error.args[0]}"
    return list_changes(changes(known, asked))


_KNOWN = ("parameters", "observation", "horizon", "control_step")
"""A model has learnt what these mean."""


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
