"""The Parquet columns: one row per episode, in a file that explains itself."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float32, Int64, UInt8

from workers.dataset.identity import Identity
from workers.rollout import Episode

ROW_GROUP = 64  # episodes
_SPLIT = ["x.list.element", "xi.list.element", "y", "f"]


@dataclass(frozen=True)
class Columns:
    """Episodes as arrays, in the order of the file.

    Attributes:
        episode: indices.
        x: controllers.
        xi: trajectories, channel-major.
        bad: bits of the bad conditions per step.
        y: badness.
        f: objective.
        stop: stop reason of each, "" for none.
    """

    episode: Int64[np.ndarray, " n"]
    x: Float32[np.ndarray, "n d"]
    xi: Float32[np.ndarray, "n obs time"]
    bad: UInt8[np.ndarray, "n time"]
    y: Float32[np.ndarray, " n"]
    f: Float32[np.ndarray, " n"]
    stop: tuple[str, ...]


def schema(identity: Identity) -> pa.Schema:
    """Columns and metadata of every file of a dataset."""
    size = len(identity.observation) * identity.horizon
    physics = pa.struct([pa.field(name, pa.float64(), nullable=False) for name in identity.physics])
    metadata = {
        "svaedc.identity": identity.to_json(),
        "svaedc.digest": identity.digest,
        "svaedc.layout": json.dumps(
            {
                "xi": ["observation", "time"],
                "xi_shape": [len(identity.observation), identity.horizon],
                "bad": "one bit per condition, the first condition lowest",
            }
        ),
    }
    columns = {
        "episode": pa.int64(),
        "x": pa.list_(pa.field("element", pa.float32(), nullable=False), len(identity.parameters)),
        "xi": pa.list_(pa.field("element", pa.float32(), nullable=False), size),
        "bad": pa.list_(pa.field("element", pa.uint8(), nullable=False), identity.horizon),
        "y": pa.float32(),
        "f": pa.float32(),
        "stop": pa.dictionary(pa.int8(), pa.string()),
        "physics": physics,
    }
    return pa.schema([pa.field(name, kind, nullable=False) for name, kind in columns.items()], metadata=metadata)


def write(path: Path, identity: Identity, start: int, episodes: Sequence[Episode]) -> None:
    """Write consecutive episodes, the first with index `start`: zstd over byte streams split by significance."""
    layout = schema(identity)
    arrays = {
        "episode": pa.array(np.arange(start, start + len(episodes))),
        "x": _lists([episode.x for episode in episodes], layout.field("x").type),
        "xi": _lists([episode.xi for episode in episodes], layout.field("xi").type),
        "bad": _lists([episode.bad for episode in episodes], layout.field("bad").type),
        "y": pa.array(np.array([episode.y for episode in episodes], dtype=np.float32)),
        "f": pa.array(np.array([episode.f for episode in episodes], dtype=np.float32)),
        "stop": pa.array([episode.stop for episode in episodes]).dictionary_encode().cast(layout.field("stop").type),
        "physics": pa.array([dict(episode.physics) for episode in episodes], type=layout.field("physics").type),
    }
    pq.write_table(
        pa.table(arrays, schema=layout),
        path,
        row_group_size=ROW_GROUP,
        compression="zstd",
        compression_level=1,
        use_dictionary=["stop"],
        use_byte_stream_split=_SPLIT,
    )


def _lists(arrays: Sequence[np.ndarray], kind: pa.DataType) -> pa.Array:
    flat = np.stack(arrays).reshape(-1)
    return pa.FixedSizeListArray.from_arrays(pa.array(flat, type=kind.value_type), type=kind)


def read_identity(path: Path) -> Identity:
    """The identity in a file's own metadata.

    Raises:
        ValueError: when the file is no Parquet file of this project.
    """
    try:
        metadata = pq.read_schema(path).metadata or {}
    except (pa.ArrowInvalid, OSError) as error:
        raise ValueError(f"{path} is not a readable Parquet file: {error}") from error
    if b"svaedc.identity" not in metadata:
        raise ValueError(f"{path} does not hold episodes of this project: no svaedc.identity in its metadata")
    return Identity.from_json(metadata[b"svaedc.identity"].decode())


def read(path: Path, identity: Identity, *, row_groups: Sequence[int] | None = None) -> Columns:
    """The episodes of a file, or of some of its row groups.

    Raises:
        ValueError: when the file is damaged or not of this schema.
    """
    try:
        file = pq.ParquetFile(path)
        groups = range(file.num_row_groups) if row_groups is None else row_groups
        table = file.read_row_groups(list(groups))
    except (pa.ArrowInvalid, OSError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
    if not table.schema.equals(schema(identity)):
        raise ValueError(f"{path} has other columns than schema version {identity.schema_version}")
    shape = (len(identity.observation), identity.horizon)
    return Columns(
        episode=table["episode"].to_numpy(),
        x=_dense(table["x"], (len(identity.parameters),)),
        xi=_dense(table["xi"], shape),
        bad=_dense(table["bad"], (identity.horizon,)),
        y=table["y"].to_numpy(),
        f=table["f"].to_numpy(),
        stop=tuple(table["stop"].to_pylist()),
    )


def row_groups(path: Path) -> int:
    """How many row groups a file has."""
    return pq.ParquetFile(path).num_row_groups


def _dense(column: pa.ChunkedArray, shape: tuple[int, ...]) -> Any:
    flat = column.combine_chunks()
    values = flat.flatten() if isinstance(flat, pa.FixedSizeListArray) else pa.concat_arrays(flat.chunks).flatten()
    return values.to_numpy().reshape(len(column), *shape)
