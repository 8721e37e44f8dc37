"""What a controller does not decide: how its repeats under different physics differ among themselves."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float32, Float64, Int64

from workers.dataset.folder import Dataset
from workers.episode import UNUSABLE

_MUCH = 0.5
TRAJECTORIES = 1_000
"""At most so many episodes are used for the share of ξ."""


@dataclass(frozen=True)
class Irreducible:
    """What remains unknown of an episode for whoever knows its controller, but not its physics.

    Controllers with a repeat that is missing or diverged are left out. NaN where nothing varies.

    Attributes:
        controllers: how many the shares of y and f come from.
        y: share of the variance of y.
        f: share of the variance of f.
        xi: bounds of the least mean absolute error of ξ in parts of that of the per-step median, averaged
            over the channels that move: as `gen_norm` of a training measures it. The lower one predicts a
            repeat by the median of its controller's repeats, the upper one by the median of the others.
    """

    controllers: int
    y: float
    f: float
    xi: tuple[float, float]

    @property
    def notes(self) -> tuple[str, ...]:
        """What to do where controllers decide less than half of y or f; nothing where they decide more."""
        if not (self.y > _MUCH or self.f > _MUCH):  # NaN where nothing varies
            return ()
        return (
            "more than half of what happens is decided by the hidden physics, whatever the controller: no "
            "model can learn that; narrow the ranges of physics, or give the controller more feedback",
        )


def irreducible(dataset: Dataset) -> Irreducible | None:
    """The irreducible part of a dataset with repeats; None when it has fewer than two whole controllers.

    Raises:
        ValueError: a file is damaged or not the dataset's, or the dataset has no repeats.
    """
    repeats = dataset.identity.repeats
    if repeats < 2:
        raise ValueError(f"{dataset.folder} must hold repeats of its controllers, got repeats = {repeats}")
    episode: list[int] = []
    stop: list[str] = []
    all_y, all_f = [], []
    for shard in dataset.shards():
        outcomes = dataset.outcomes(shard)
        episode += outcomes.episode.tolist()
        stop += outcomes.stop
        all_y.append(outcomes.y)
        all_f.append(outcomes.f)
    rows = _whole(episode, stop, repeats)
    if len(rows) < 2:
        return None
    y, f = (np.concatenate(values)[rows] for values in (all_y, all_f))
    xi = error_bounds(_trajectories(dataset))
    return Irreducible(len(rows), share(y.astype(np.float64)), share(f.astype(np.float64)), xi)


def share(values: Float64[np.ndarray, "controllers repeats"]) -> float:
    """Variance within controllers in parts of the variance of one episode, both estimated without bias.

    The latter is half the mean squared difference of two episodes of different controllers.
    """
    controllers, repeats = values.shape
    count = values.size
    within = values.var(axis=1)
    total = (count**2 * values.var() - repeats**2 * within.sum()) / (count**2 - controllers * repeats**2)
    return float(within.mean() * repeats / (repeats - 1) / total) if total > 0.0 else float("nan")


def error_bounds(xi: Float32[np.ndarray, "controllers repeats obs time"]) -> tuple[float, float]:
    """The two numbers of `Irreducible.xi`, of trajectories in any units."""
    ratios = [
        (_within_controllers(channel) / spread, _between_controllers(channel) / spread)
        for channel in np.moveaxis(xi, 2, 0)
        if (spread := float(np.abs(channel - np.median(channel, axis=(0, 1))).mean())) > 0.0
    ]
    low, high = np.mean(ratios, axis=0) if ratios else (np.nan, np.nan)
    return float(low), float(high)


def _within_controllers(channel: Float32[np.ndarray, "controllers repeats time"]) -> float:
    return float(np.abs(channel - np.median(channel, axis=1, keepdims=True)).mean())


def _between_controllers(channel: Float32[np.ndarray, "controllers repeats time"]) -> float:
    errors = [
        np.abs(channel[:, one] - np.median(np.delete(channel, one, axis=1), axis=1)).mean()
        for one in range(channel.shape[1])
    ]
    return float(np.mean(errors))


def _whole(
    episode: Sequence[int], stop: Sequence[str], repeats: int
) -> Int64[np.ndarray, "controllers repeats"]:
    """Rows, in ascending episodes, of the controllers of which every repeat may be learnt from."""
    sane = np.flatnonzero([reason not in UNUSABLE for reason in stop])
    numbers = np.asarray(episode, dtype=np.int64)[sane] // repeats
    _, first, counts = np.unique(numbers, return_index=True, return_counts=True)
    return sane[first[counts == repeats][:, None] + np.arange(repeats)]


def _trajectories(dataset: Dataset) -> Float32[np.ndarray, "controllers repeats obs time"]:
    """Of the first whole controllers, from as few files as hold `TRAJECTORIES` episodes."""
    episode: list[int] = []
    stop: list[str] = []
    xi = []
    for _, columns in dataset.batches():
        episode += columns.episode.tolist()
        stop += columns.stop
        xi.append(columns.xi)
        if len(episode) >= TRAJECTORIES:
            break
    rows = _whole(episode, stop, dataset.identity.repeats)
    return np.concatenate(xi)[rows[: TRAJECTORIES // dataset.identity.repeats]]
