"""A dataset in the layout of LeRobot datasets v3.0: one row per control step, one Parquet file per shard.

Layout and field names are those of https://github.com/huggingface/lerobot, `CODEBASE_VERSION = "v3.0"`.
There is no `action`: what was chosen is one controller `x` for the whole episode, and it stands there.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Shaped

from workers.dataset.folder import Dataset
from workers.dataset.identity import Identity
from workers.dataset.schema import Columns
from workers.dataset.shards import Shard
from workers.dataset.storage.location import arrow_name


@dataclass
class Moments:
    """Count, range, mean and spread of the columns of all rows that were added.

    Mean and spread are kept as sums of deviations (Chan, Golub and LeVeque 1983), which do not cancel.
    """

    count: int = 0
    low: np.ndarray = field(default_factory=lambda: np.array(np.inf))
    high: np.ndarray = field(default_factory=lambda: np.array(-np.inf))
    mean: np.ndarray = field(default_factory=lambda: np.array(0.0))
    deviation: np.ndarray = field(default_factory=lambda: np.array(0.0))

    def add(self, rows: Shaped[np.ndarray, "n columns"]) -> None:
        """Take further rows into account."""
        mean = rows.mean(axis=0, dtype=np.float64)
        deviation = ((rows - mean) ** 2).sum(axis=0)
        total = self.count + len(rows)
        step = mean - self.mean
        self.deviation = self.deviation + deviation + step**2 * self.count * len(rows) / total
        self.mean = self.mean + step * len(rows) / total
        self.low = np.minimum(self.low, rows.min(axis=0))
        self.high = np.maximum(self.high, rows.max(axis=0))
        self.count = total

    def as_lists(self) -> dict[str, list[float]]:
        """The statistics by the names that LeRobot gives them; the spread is that of the rows themselves."""
        return {
            "min": np.atleast_1d(self.low).astype(float).tolist(),
            "max": np.atleast_1d(self.high).astype(float).tolist(),
            "mean": np.atleast_1d(self.mean).tolist(),
            "std": np.atleast_1d(np.sqrt(self.deviation / max(self.count, 1))).tolist(),
            "count": [self.count],
        }


VERSION = "v3.0"
FILES_PER_CHUNK = 1000
_PLACE = "chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
_DATA_PATH = f"data/{_PLACE}"
_EPISODES_PATH = f"meta/episodes/{_PLACE}"
_INDICES = ("frame_index", "episode_index", "index", "task_index")


def export_lerobot(dataset: Dataset, out: Path) -> Iterator[Shard]:
    """Write the dataset to a folder, one shard in memory at a time.

    Episodes are numbered from 0 without gaps, as the format asks; `svaedc.episode` is the number here.

    Args:
        dataset: what is exported.
        out: an existing folder.

    Yields:
        Each shard once it is written.

    Raises:
        ValueError: a shard is damaged, or two overlap.
    """
    shards = dataset.disjoint()
    task = f"{dataset.identity.setup}: {', '.join(dataset.identity.conditions)} are bad"
    moments = {"observation.state": Moments(), "bad": Moments(), "timestamp": Moments()}
    first = 0
    for number, shard in enumerate(shards):
        columns = dataset.read(shard)
        place = {"chunk_index": number // FILES_PER_CHUNK, "file_index": number % FILES_PER_CHUNK}
        frames = _frames(columns, dataset.identity, first)
        _write(frames, out / _DATA_PATH.format(**place), dataset.identity.horizon)
        _write(_episodes(columns, dataset.identity, first, place, task), out / _EPISODES_PATH.format(**place))
        _observe(moments, columns, dataset.identity)
        first += shard.episodes
        yield shard
    _write(_tasks(task), out / "meta/tasks.parquet")
    _write_json(_info(dataset.identity, first), out / "meta/info.json")
    _write_json({name: each.as_lists() for name, each in moments.items()}, out / "meta/stats.json")


def _frames(columns: Columns, identity: Identity, first: int) -> pa.Table:
    """One row per control step, in the order of time within that of episodes."""
    episodes, steps = columns.bad.shape
    channels = len(identity.observation)
    states = np.ascontiguousarray(columns.xi.transpose(0, 2, 1)).reshape(-1)
    frame = np.tile(np.arange(steps), episodes)
    return pa.table(
        {
            "observation.state": pa.FixedSizeListArray.from_arrays(pa.array(states), channels),
            "bad": columns.bad.reshape(-1),
            "timestamp": _timestamps(identity, episodes),
            "frame_index": frame,
            "episode_index": np.repeat(np.arange(first, first + episodes), steps),
            "index": np.arange(first * steps, (first + episodes) * steps),
            "task_index": np.zeros(episodes * steps, dtype=np.int64),
        }
    )


def _episodes(
    columns: Columns, identity: Identity, first: int, place: Mapping[str, int], task: str
) -> pa.Table:
    """One row per episode: where its frames are, and what it was."""
    count, steps = columns.bad.shape
    index = np.arange(first, first + count)
    width = len(identity.parameters)
    return pa.table(
        {
            "episode_index": index,
            "tasks": [[task]] * count,
            "length": np.full(count, steps),
            "data/chunk_index": np.full(count, place["chunk_index"]),
            "data/file_index": np.full(count, place["file_index"]),
            "dataset_from_index": index * steps,
            "dataset_to_index": (index + 1) * steps,
            "meta/episodes/chunk_index": np.full(count, place["chunk_index"]),
            "meta/episodes/file_index": np.full(count, place["file_index"]),
            "svaedc.episode": columns.episode,
            "svaedc.x": pa.FixedSizeListArray.from_arrays(pa.array(columns.x.reshape(-1)), width),
            "svaedc.y": columns.y,
            "svaedc.f": columns.f,
            "svaedc.stop": pa.array(columns.stop),
            **{f"svaedc.physics.{name}": columns.physics[name] for name in sorted(identity.physics)},
        }
    )


def _tasks(task: str) -> pa.Table:
    """As pandas writes a frame whose index is the task: LeRobot reads it back with pandas."""
    kinds = {"task_index": "int64", "task": "unicode"}
    columns = [
        {"name": name, "field_name": name, "pandas_type": kind, "numpy_type": "object", "metadata": None}
        for name, kind in kinds.items()
    ]
    described = {"index_columns": ["task"], "columns": columns, "column_indexes": []}
    metadata = {"pandas": json.dumps(described)}
    return pa.table({"task_index": [0], "task": [task]}).replace_schema_metadata(metadata)


def _observe(moments: Mapping[str, Moments], columns: Columns, identity: Identity) -> None:
    states = columns.xi.transpose(0, 2, 1).reshape(-1, len(identity.observation))
    moments["observation.state"].add(states)
    moments["bad"].add(columns.bad.reshape(-1, 1))
    moments["timestamp"].add(_timestamps(identity, len(columns.bad))[:, None])


def _timestamps(identity: Identity, episodes: int) -> np.ndarray:
    """Seconds since the episode began."""
    return np.tile(np.arange(identity.horizon) * identity.control_step, episodes).astype(np.float32)


def _info(identity: Identity, episodes: int) -> dict[str, Any]:
    rate = 1.0 / identity.control_step
    return {
        "codebase_version": VERSION,
        "robot_type": identity.setup,
        "total_episodes": episodes,
        "total_frames": episodes * identity.horizon,
        "total_tasks": 1,
        "chunks_size": FILES_PER_CHUNK,
        "data_files_size_in_mb": 100,
        "video_files_size_in_mb": 200,
        "fps": round(rate) if abs(rate - round(rate)) < 1e-6 else rate,
        "splits": {"train": f"0:{episodes}"},
        "data_path": _DATA_PATH,
        "video_path": None,
        "features": _features(identity),
        "svaedc": json.loads(identity.to_json()),
    }


def _features(identity: Identity) -> dict[str, dict[str, Any]]:
    names = [name for name, *_ in identity.observation]
    return {
        "observation.state": {"dtype": "float32", "shape": [len(names)], "names": names},
        "bad": {
            "dtype": "float32" if identity.bad_kind == "graded" else "uint8",
            "shape": [1],
            "names": None,
        },
        "timestamp": {"dtype": "float32", "shape": [1], "names": None},
        **{name: {"dtype": "int64", "shape": [1], "names": None} for name in _INDICES},
    }


def _write(table: pa.Table, path: Path, row_group: int | None = None) -> None:
    """A row group per episode, so that a reader may fetch one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(table, arrow_name(path), row_group_size=row_group, compression="zstd")


def _write_json(content: Mapping[str, Any], path: Path) -> None:
    path.write_text(json.dumps(content, indent=4) + "\n", encoding="utf-8")
