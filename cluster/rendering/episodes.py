"""The episode that a person asks to see: of a controller given in one of four ways."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from cluster.errors import UsageError, UserError
from cluster.home import expand_home
from cluster.inputs import dataset_location, usage_errors
from cluster.progress import say
from workers.controllers.controller import unit_cube
from workers.dataset.folder import Dataset, open_dataset
from workers.episode import Episode
from workers.physics import Physics
from workers.randomness import Stream, generator
from workers.rollout import rollout
from workers.setups import Setup
from workers.user_code import describe, full_traceback

FORMS = "random:SEED, dataset:FOLDER:INDEX, the path of an .npy file, or numbers separated by commas"


def episode_to_draw(wanted: str, setup: Setup, physics: Physics | None) -> Episode:
    """Find the episode of a dataset, or roll a controller out.

    Args:
        wanted: one of `FORMS`.
        setup: what runs the controller.
        physics: that it runs under. Without it an episode of a dataset keeps its own, and other controllers
            run under the nominal physics.

    Returns:
        The episode; one of a dataset is as it was recorded, unless physics is given.

    Raises:
        UsageError: there is no such controller.
        UserError: the dataset cannot be read.
    """
    kind, _, rest = wanted.partition(":")
    if kind == "dataset":
        recorded = _dataset_episode(wanted, rest, setup)
        return recorded if physics is None else _roll_out(setup, recorded.x, physics)
    x = _random(wanted, rest, setup) if kind == "random" else _controller(wanted, setup)
    return _roll_out(setup, x, setup.physics.middle() if physics is None else physics)


def physics_of(setup: Setup, seed: int | None, written: str) -> Physics | None:
    """The physics that a person asks for.

    Args:
        setup: whose physics.
        seed: of a draw from the ranges of data collection; None for none.
        written: values as `NAME=VALUE,...`; "" for none. What is not named is nominal.

    Returns:
        The parameters, by name; None where nothing is asked for.

    Raises:
        UsageError: both are asked for, or there is no such parameter.
    """
    if not written:
        return None if seed is None else first_physics(setup, seed)
    if seed is not None:
        raise UsageError("--physics says what the physics is, and --seed draws it: leave one of them out")
    with usage_errors():
        return setup.gap(written if "=" in written else f"{written}=").middle()


def first_physics(setup: Setup, seed: int) -> Physics:
    """Draw the physics of episode 0 of a dataset.

    Args:
        setup: whose ranges of data collection they are drawn from.
        seed: of the dataset.

    Returns:
        The parameters, by name.
    """
    return setup.physics.draw(generator(seed, Stream.PHYSICS, 0))


def _roll_out(setup: Setup, x: np.ndarray, physics: Physics) -> Episode:
    """Users' code may raise: whoever looks at one episode wants all of the traceback."""
    try:
        with setup.open() as environment:
            return rollout(setup, environment, x, physics)
    except OSError:
        raise
    except Exception as error:
        say(full_traceback(error))
        raise UserError(f"the episode of {setup.name} failed: {describe(error)}") from error


def _random(wanted: str, seed: str, setup: Setup) -> np.ndarray:
    """The controller of episode 0 of a dataset with that seed."""
    number = _whole(wanted, seed, "SEED")
    return generator(number, Stream.CONTROLLER, 0).random(setup.dimensions, dtype=np.float32)


def _whole(wanted: str, text: str, name: str) -> int:
    if not (text.isascii() and text.isdigit()):
        raise UsageError(f"--x {wanted}: {name} must be a whole number from 0, got {text!r}; use {FORMS}")
    return int(text)


def _controller(wanted: str, setup: Setup) -> np.ndarray:
    with _errors_named(wanted, setup):
        if wanted.endswith(".npy"):
            return unit_cube(np.load(expand_home(Path(wanted)), allow_pickle=False), setup.dimensions)
        return unit_cube([float(number) for number in wanted.split(",")], setup.dimensions)


@contextmanager
def _errors_named(wanted: str, setup: Setup) -> Iterator[None]:
    shown = wanted if len(wanted) <= 60 else wanted[:57] + "..."
    try:
        yield
    except (ValueError, OSError) as error:
        raise UsageError(
            f"--x {shown}: {error}; {setup.name} takes {setup.dimensions} numbers in [0, 1], "
            f"and --x may be {FORMS}"
        ) from error


def _dataset_episode(wanted: str, rest: str, setup: Setup) -> Episode:
    folder, _, place = rest.rpartition(":")
    if not folder:
        raise UsageError(f"--x {wanted} names no episode; write dataset:FOLDER:INDEX")
    index = _whole(wanted, place, "INDEX")
    try:
        dataset = open_dataset(dataset_location(folder))
        _require_same(dataset, setup)
        return dataset.episode(index)
    except IndexError as error:
        raise UsageError(str(error)) from error
    except ValueError as error:
        raise UserError(str(error)) from error


def _require_same(dataset: Dataset, setup: Setup) -> None:
    identity = dataset.identity
    if identity.setup != setup.name:
        raise UsageError(
            f"{dataset.folder} is of {identity.setup}, not of {setup.name}; use --setup {identity.setup}"
        )
    if identity.bad_name:
        raise UsageError(
            f"{dataset.folder} was collected under the G_bad {identity.bad_name}, and a picture shows the "
            "setup's own; give the controller itself to --x instead"
        )
    channels = tuple(channel.name for channel in setup.observation)
    if (tuple(row[0] for row in identity.observation), identity.conditions) != (channels, setup.conditions):
        raise UserError(
            f"{dataset.folder} was collected when {setup.name} had other channels or conditions; "
            "collect it anew"
        )
