"""The training cache: a dataset decoded once into memory-mapped arrays, at the stride of training."""

import errno
import math
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Bool, Float32, Int64

from workers.dataset.cache_files import Layout, finish, is_finished, make, open_arrays
from workers.dataset.folder import Dataset
from workers.dataset.identity import Identity
from workers.dataset.schema import Columns
from workers.dataset.shards import Shard
from workers.dataset.storage.location import Location
from workers.dataset.storage.temporary import is_dead, writer
from workers.episode import UNUSABLE, degrees, stride_steps

_CHANGED = "{} was changed while it was decoded; let whatever repairs or replaces it end, and run this again"


@dataclass(frozen=True)
class TrainingCache:
    """Memory-mapped arrays of N episodes and S = T // stride samples.

    Diverged episodes are left out; those that a stop rule ended are not.

    Attributes:
        repeats: consecutive episodes that share a controller.
        episode: indices.
        x: controllers in [0,1]^D.
        xi: trajectories in the units of the setup's channels, the last step of every stride.
        bad: 1 where a bad condition held at the sampled step, else 0; the degree of a graded G_bad.
        y: badness over all T steps.
        f: objective.
    """

    repeats: int
    episode: Int64[np.ndarray, " n"]
    x: Float32[np.ndarray, "n d"]
    xi: Float32[np.ndarray, "n obs samples"]
    bad: Float32[np.ndarray, "n samples"]
    y: Float32[np.ndarray, " n"]
    f: Float32[np.ndarray, " n"]

    def controller(self) -> Int64[np.ndarray, " n"]:
        """The number of each row's controller; rows with the same number have the same x."""
        return np.asarray(self.episode) // self.repeats

    def held_out(self) -> Int64[np.ndarray, " held_out"]:
        """Rows kept from training: those of every tenth controller, however far the data grows."""
        return np.flatnonzero(self._is_held_out())

    def training(self) -> Int64[np.ndarray, " training"]:
        """Rows to train on: all others."""
        return np.flatnonzero(~self._is_held_out())

    def _is_held_out(self) -> Bool[np.ndarray, " n"]:
        return self.controller() % 10 == 9


def training_cache(dataset: Dataset, stride: int, parent: Path) -> TrainingCache:
    """Open the cache of a dataset at a stride below `parent`, decoding the dataset first if it must.

    The folder is looked at once: what is decoded are the shards of the fingerprint that the cache is named
    after, whatever arrives meanwhile.

    Args:
        dataset: what is trained on.
        stride: control steps per sample, 1 to the horizon.
        parent: folder of all caches, made when it is missing.

    Returns:
        The cache, whose arrays can only be read.

    Raises:
        ValueError: when the stride does not fit the horizon, the dataset is empty, damaged, or holds files of
            another, episodes twice or numbers that are not finite, or the cache is damaged.
        OSError: when the disk is too small; the error names both sizes.
    """
    if not 1 <= stride <= dataset.identity.horizon:
        raise ValueError(
            f"stride must lie between 1 and the horizon {dataset.identity.horizon}, got {stride}"
        )
    shards = dataset.disjoint()
    fingerprint = dataset.fingerprint_of(shards)
    folder = parent / f"{fingerprint[:16]}-stride{stride}"
    if not is_finished(folder):
        _build(dataset, shards, fingerprint, stride, folder)
    arrays = open_arrays(folder, lambda count: _layout(dataset.identity, stride, count))
    return TrainingCache(dataset.identity.repeats, **arrays)


def _build(dataset: Dataset, shards: Sequence[Shard], fingerprint: str, stride: int, folder: Path) -> None:
    sane = {shard: dataset.sane_episodes(shard) for shard in shards}
    count = sum(sane.values())
    if count == 0:
        held = dataset.episodes()
        raise ValueError(
            f"all {held} episodes of {dataset.folder} diverged or failed, there is nothing to learn from: "
            f"`svaedc dataset info {dataset.folder}` says more"
            if held
            else f"{dataset.folder} holds no episodes to train on; collect some first"
        )
    folder.parent.mkdir(parents=True, exist_ok=True)
    _sweep(folder.parent)
    layout = _layout(dataset.identity, stride, count)
    needed = sum(np.dtype(kind).itemsize * math.prod(shape) for kind, shape in layout.values())
    require_space(needed, shutil.disk_usage(folder.parent).free, folder.parent)
    building = folder.with_name(f"{folder.name}.{writer()}")
    building.mkdir(exist_ok=True)
    try:
        _decode(dataset, sane, stride, make(building, layout))
        if dataset.fingerprint_of(shards) != fingerprint:
            raise ValueError(_CHANGED.format(dataset.folder))
        finish(building, layout, {"episodes": count, "stride": stride})
        _move_into_place(building, folder)
    finally:
        shutil.rmtree(building, ignore_errors=True)


def _sweep(parent: Path) -> None:
    """Remove what builders left behind that were killed."""
    for path in parent.iterdir():
        if "-stride" in path.name and is_dead(path.name):
            shutil.rmtree(path, ignore_errors=True)


def require_space(needed: int, free: int, folder: Path) -> None:
    """Refuse to begin a cache that will not fit.

    Args:
        needed: bytes of the cache.
        free: bytes left on the disk.
        folder: below which it is to lie, for the error.

    Raises:
        OSError: when more bytes are needed than are free; it names both, and the ways out.
    """
    if needed > free:
        raise OSError(
            errno.ENOSPC,
            f"the training cache needs {needed / 1e9:.2f} GB below {folder}, only {free / 1e9:.2f} GB are "
            "free; free some, choose another folder (train.cache_folder), or a larger stride (train.stride)",
        )


def _move_into_place(building: Path, folder: Path) -> None:
    """First writer wins: another process may have decoded the same dataset meanwhile."""
    try:
        building.rename(folder)
    except OSError:
        if not is_finished(folder):
            raise


def _layout(identity: Identity, stride: int, count: int) -> Layout:
    """Type and shape of every array."""
    samples = identity.horizon // stride
    return {
        "episode": (np.int64, (count,)),
        "x": (np.float32, (count, len(identity.parameters))),
        "xi": (np.float32, (count, len(identity.observation), samples)),
        "bad": (np.float32, (count, samples)),
        "y": (np.float32, (count,)),
        "f": (np.float32, (count,)),
    }


def _decode(
    dataset: Dataset, sane: Mapping[Shard, int], stride: int, arrays: Mapping[str, np.memmap]
) -> None:
    """Fill the arrays with the sane episodes of the shards, of each as many as were counted."""
    filled = 0
    for shard, size in sane.items():
        rows = _subsample(dataset.read(shard), stride_steps(dataset.identity.horizon, stride))
        if len(rows["episode"]) != size:
            raise ValueError(_CHANGED.format(dataset.path(shard)))
        _require_finite(rows, dataset.path(shard))
        for name, values in rows.items():
            arrays[name][filled : filled + size] = values
        filled += size
    for array in arrays.values():
        array.flush()


def _subsample(columns: Columns, steps: slice) -> dict[str, np.ndarray]:
    sane = np.array([stop not in UNUSABLE for stop in columns.stop])
    return {
        "episode": columns.episode[sane],
        "x": columns.x[sane],
        "xi": columns.xi[sane][:, :, steps],
        "bad": degrees(columns.bad[sane][:, steps]),
        "y": columns.y[sane],
        "f": columns.f[sane],
    }


def _require_finite(rows: Mapping[str, np.ndarray], path: Location) -> None:
    """Refuse what would turn the model's every weight into NaN many updates later."""
    for name in ("x", "xi", "bad", "y", "f"):
        strange = ~np.isfinite(rows[name]).all(axis=tuple(range(1, rows[name].ndim)))
        if strange.any():
            raise ValueError(
                f"{path.name} holds NaN or infinity in {name} of episode {rows['episode'][strange][0]}, "
                f"where every number must be finite; delete {path} and collect it again"
            )
