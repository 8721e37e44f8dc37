"""Random generators that depend on (seed, stream, index) alone, whoever draws and in whatever order."""

import zlib

import numpy as np


def generator(seed: int, stream: str, index: int) -> np.random.Generator:
    """Make a generator of its own for every (seed, stream, index).

    Args:
        seed: of the dataset, comparison or campaign, at least 0.
        stream: what is drawn, such as "controller", "physics" or "pool".
        index: of the episode, run or trial, at least 0.

    Returns:
        The same numbers, in the same order, for the same three.

    Raises:
        ValueError: when seed or index is negative.
    """
    if seed < 0 or index < 0:
        raise ValueError(f"seed and index must be at least 0, got {seed} and {index}")
    return np.random.default_rng(np.random.SeedSequence([seed, zlib.crc32(stream.encode()), index]))
