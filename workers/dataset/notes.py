"""What is odd about a dataset's episodes, told before a model is trained on them."""

from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np
from jaxtyping import Float32

from workers.dataset.folder import Dataset
from workers.dataset.schema import Columns
from workers.dataset.shards import Shard
from workers.episode import DIVERGED, FAILED, UNUSABLE

SHARDS = 4
"""So many files are looked at, spread over the dataset."""
NARROW = 1e-4
"""A channel that stays within this part of its bounds is stored with few digits, and hardly learnt."""
UNUSABLE_SHARE = 0.1
"""With more diverged or failed episodes than this share, something is wrong with the robot or its ranges."""


def notes(dataset: Dataset) -> list[str]:
    """Look at some files of a dataset for what makes it of little use.

    Args:
        dataset: whose episodes are looked at.

    Returns:
        A sentence for each thing that is odd, with the remedy; none where nothing is.

    Raises:
        ValueError: a file is damaged.
    """
    looked = [dataset.read(shard) for shard in _spread(dataset.shards())]
    return [*_endings(looked), *value_notes(dataset, looked)]


def value_notes(dataset: Dataset, looked: Sequence[Columns]) -> Iterator[str]:
    """Tell what is odd about the values of episodes that came to their end.

    Args:
        dataset: that they belong to.
        looked: episodes of some of its files.

    Yields:
        A sentence for each constant, and for each channel that hardly moves, with the remedy.
    """
    yield from _constants(dataset, looked)
    yield from _narrow_channels(dataset, looked)


def _spread(shards: Sequence[Shard]) -> list[Shard]:
    places = np.linspace(0, len(shards) - 1, SHARDS).round().astype(int) if shards else np.empty(0, int)
    return [shards[place] for place in np.unique(places)]


def _endings(looked: Sequence[Columns]) -> Iterator[str]:
    stops = Counter(stop for columns in looked for stop in columns.stop)
    episodes = stops.total()
    for reason, remedy in (
        (
            DIVERGED,
            "make the channels' bounds wider, the controller's ranges narrower, or the time step smaller",
        ),
        (
            FAILED,
            "their errors are in the folder `quarantine` beside the shards; mend the code, and collect anew",
        ),
    ):
        share = stops[reason] / max(episodes, 1)
        if share == 1:
            yield f"every episode {reason}, so there is nothing to learn from: {remedy}"
        elif share > UNUSABLE_SHARE:
            yield f"{share:.0%} of the episodes {reason}, and no model sees those: {remedy}"


def _constants(dataset: Dataset, looked: Sequence[Columns]) -> Iterator[str]:
    y, f = (_usable(looked, name) for name in ("y", "f"))
    if len(f) < 2:
        return
    if np.ptp(f) == 0:
        yield (
            f"the objective is {f[0]:g} in every episode, so there is nothing to optimise: look at "
            f"objective() of the task of {dataset.identity.setup}"
        )
    if np.ptp(y) == 0:
        yield (
            f"badness y is {y[0]:g} in every episode, so the latent space has nothing to be compressed by: "
            "make the bad conditions stricter or looser, or train with --set train.model=svae"
        )


def _narrow_channels(dataset: Dataset, looked: Sequence[Columns]) -> Iterator[str]:
    xi: Float32[np.ndarray, "n obs time"] = _usable(looked, "xi")
    if len(xi) < 2:
        return
    used = xi.max(axis=(0, 2)).astype(float) - xi.min(axis=(0, 2))
    for (name, unit, low, high), extent in zip(dataset.identity.observation, used, strict=True):
        share = float(extent) / (high - low)
        if 0 < share < NARROW:
            yield (
                f"channel {name} uses {share:.0e} of its bounds [{low:g}, {high:g}] {unit}: it looks "
                f"constant to a model; bring the bounds near the {extent:.3g} {unit} that it moves"
            )


def _usable(looked: Sequence[Columns], name: str) -> np.ndarray:
    """A column of the episodes that a model may learn from."""
    kept = [getattr(columns, name)[[stop not in UNUSABLE for stop in columns.stop]] for columns in looked]
    return np.concatenate(kept) if kept else np.empty(0, np.float32)
