"""Random generators that depend on (seed, stream, index) alone, whoever draws and in whatever order."""

import zlib
from enum import StrEnum

import numpy as np


class Stream(StrEnum):
    """What is drawn. Streams are independent of each other; their names decide the draws and never change."""

    CONTROLLER = "controller"
    """The x of an episode of a dataset; the index is that of the controller."""
    PHYSICS = "physics"
    """The physics of an episode of a dataset; the index is that of the episode."""
    HIDDEN_PHYSICS = "hidden-physics"
    """The physics that a run or a rehearsal hides; the index is 0."""
    OTHER_PHYSICS = "other-physics"
    """The physics of an episode in the second of two simulations; the index is that of the episode."""
    POOL = "pool"
    """The controllers that a run may choose from; the index is 0."""
    INITIAL = "initial"
    """The random controllers that a run begins with; the index is that of the trial."""
    SUGGESTION = "suggestion"
    """What a method draws for a suggestion; the index is that of the trial."""
    PREVIEW = "preview"
    """The physics of a simulation that shows a person what a trial may do; the index is its own."""
    BOOTSTRAP = "bootstrap"
    """The resamples of a summary; the index is 0."""


def generator(seed: int, stream: Stream, index: int) -> np.random.Generator:
    """A generator of its own for every (seed, stream, index).

    Args:
        seed: of the dataset, comparison or campaign, at least 0.
        stream: what is drawn.
        index: of the episode, run or trial, at least 0.

    Returns:
        Always the same one for the same arguments.

    Raises:
        ValueError: when seed or index is negative.
    """
    if seed < 0 or index < 0:
        raise ValueError(f"seed and index must be at least 0, got {seed} and {index}")
    return np.random.default_rng(np.random.SeedSequence([seed, zlib.crc32(stream.encode()), index]))
