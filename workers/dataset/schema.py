"""The Parquet columns: one row per episode, in a file that explains itself."""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from jaxtyping import Float32, Float64, Int64, UInt8

from workers.dataset.identity import Identity
from workers.dataset.ownership import IDENTITY_DIGEST, IDENTITY_TEXT, identity_in, require_own
from workers.dataset.quantisation import decode, describe_encoding, encode
from workers.dataset.storage.location import Location, arrow_name, source
from workers.dataset.storage.s3_connection import refusal
from workers.episode import Episode

ROW_GROUP = 64  # episodes
_XI, _BAD = "xi.list.element", "bad.list.element"
_SPLIT = ["x.list.element", _XI, "y", "f"]
_BITS = "one bit per condition, the first condition lowest"
_GRADED = "degree of badness of each step, in [0, 1]"

Bad = UInt8[np.ndarray, "n time"] | Float32[np.ndarray, "n time"]
"""It holds bits of the bad conditions per step, or degrees of a graded G_bad."""


@dataclass(frozen=True)
class Outcomes:
    """How episodes went, without their trajectories, in the order of the file.

    Attributes:
        episode: indices.
        bad: bits of the bad conditions per step, or degrees of a graded G_bad.
        y: badness.
        f: objective.
        stop: stop reason of each, "" for none.
    """

    episode: Int64[np.ndarray, " n"]
    bad: Bad
    y: Float32[np.ndarray, " n"]
    f: Float32[np.ndarray, " n"]
    stop: tuple[str, ...]


@dataclass(frozen=True)
class Columns:
    """Episodes as arrays, in the order of the file.

    Attributes:
        episode: indices.
        x: controllers.
        xi: trajectories, channel-major.
        bad: bits of the bad conditions per step, or degrees of a graded G_bad.
        y: badness.
        f: objective.
        stop: stop reason of each, "" for none.
        physics: the parameters each ran under, by name.
    """

    episode: Int64[np.ndarray, " n"]
    x: Float32[np.ndarray, "n d"]
    xi: Float32[np.ndarray, "n obs time"]
    bad: Bad
    y: Float32[np.ndarray, " n"]
    f: Float32[np.ndarray, " n"]
    stop: tuple[str, ...]
    physics: Mapping[str, Float64[np.ndarray, " n"]]

    def row(self, number: int) -> Episode:
        """The episode at a place in the file, counted from 0."""
        return Episode(
            x=self.x[number],
            xi=self.xi[number],
            bad=self.bad[number],
            y=float(self.y[number]),
            f=float(self.f[number]),
            stop=self.stop[number],
            physics={name: float(values[number]) for name, values in self.physics.items()},
        )


def schema(identity: Identity) -> pa.Schema:
    """Columns and metadata of every file of a dataset."""
    size = len(identity.observation) * identity.horizon
    physics = pa.struct([pa.field(name, pa.float64(), nullable=False) for name in sorted(identity.physics)])
    metadata = {
        IDENTITY_TEXT: identity.to_json(),
        IDENTITY_DIGEST: identity.digest,
        "svaedc.layout": json.dumps(
            {
                "xi": ["observation", "time"],
                "xi_shape": [len(identity.observation), identity.horizon],
                **describe_encoding(identity),
                "bad": _GRADED if _is_graded(identity) else _BITS,
            }
        ),
    }
    columns: dict[str, pa.DataType] = {
        "episode": pa.int64(),
        "x": pa.list_(pa.field("element", pa.float32(), nullable=False), len(identity.parameters)),
        "xi": pa.list_(pa.field("element", _kind_of_xi(identity), nullable=False), size),
        "bad": pa.list_(
            pa.field("element", pa.float32() if _is_graded(identity) else pa.uint8(), nullable=False),
            identity.horizon,
        ),
        "y": pa.float32(),
        "f": pa.float32(),
        "stop": pa.dictionary(pa.int8(), pa.string()),
    }
    if identity.physics:  # Parquet knows no structs without fields
        columns["physics"] = physics
    return pa.schema(
        [pa.field(name, kind, nullable=False) for name, kind in columns.items()], metadata=metadata
    )


def write(path: Path, identity: Identity, start: int, episodes: Sequence[Episode]) -> None:
    """Write consecutive episodes, compressed by zstd.

    Args:
        path: of the new file.
        identity: of the dataset.
        start: index of the first episode.
        episodes: at least one.
    """
    layout = schema(identity)
    kinds = {field.name: field.type for field in layout}
    arrays = {
        "episode": pa.array(np.arange(start, start + len(episodes))),
        "x": _lists([episode.x for episode in episodes], kinds["x"]),
        "xi": _lists([encode(episode.xi, identity) for episode in episodes], kinds["xi"]),
        "bad": _lists([episode.bad for episode in episodes], kinds["bad"]),
        "y": pa.array([episode.y for episode in episodes], type=kinds["y"]),
        "f": pa.array([episode.f for episode in episodes], type=kinds["f"]),
        "stop": pa.array([episode.stop for episode in episodes]).dictionary_encode().cast(kinds["stop"]),
    }
    if "physics" in kinds:
        arrays["physics"] = pa.array([dict(episode.physics) for episode in episodes], type=kinds["physics"])
    pq.write_table(
        pa.table(arrays, schema=layout),
        arrow_name(path),
        row_group_size=ROW_GROUP,
        compression="zstd",
        compression_level=1,
        use_dictionary=["stop"],
        write_page_checksum=True,
        **_encodings(identity),
    )


def _is_graded(identity: Identity) -> bool:
    return identity.bad_kind == "graded"


def _encodings(identity: Identity) -> dict[str, Any]:
    """Floats are split by byte; codes of int16 are stored as differences in time."""
    split = [*_SPLIT, _BAD] if _is_graded(identity) else _SPLIT
    if identity.storage == "float32":
        return {"use_byte_stream_split": split}
    return {
        "use_byte_stream_split": [name for name in split if name != _XI],
        "column_encoding": {_XI: "DELTA_BINARY_PACKED"},
    }


def _kind_of_xi(identity: Identity) -> pa.DataType:
    return pa.float32() if identity.storage == "float32" else pa.int16()


def _lists(arrays: Sequence[np.ndarray], kind: pa.DataType) -> pa.Array:
    flat = np.stack(arrays).reshape(-1)
    return pa.FixedSizeListArray.from_arrays(pa.array(flat, type=kind.value_type), type=kind)


def read_identity(path: Location) -> Identity:
    """The identity in a file's own metadata.

    Raises:
        ValueError: when the file is no Parquet file of this project.
    """
    with _name_damage(path):
        metadata = pq.read_schema(source(path)).metadata or {}
    return identity_in(path, metadata)


def read(path: Location, identity: Identity) -> Columns:
    """Read the episodes of a file, every page checked against its checksum.

    Args:
        path: of the file.
        identity: of the dataset that it must belong to.

    Returns:
        All columns, ξ decoded.

    Raises:
        ValueError: when the file is damaged, of another dataset, or not of this schema.
    """
    table = _table(path, identity, schema(identity).names)
    shape = (len(identity.observation), identity.horizon)
    return Columns(
        episode=table["episode"].to_numpy(),
        x=_dense(table["x"], (len(identity.parameters),)),
        xi=decode(_dense(table["xi"], shape), identity),
        bad=_dense(table["bad"], (identity.horizon,)),
        y=table["y"].to_numpy(),
        f=table["f"].to_numpy(),
        stop=tuple(table["stop"].to_pylist()),
        physics={name: column.to_numpy() for name, column in _fields(table, identity)},
    )


def read_outcomes(path: Location, identity: Identity) -> Outcomes:
    """Read how the episodes of a file went, and none of the large columns.

    Args:
        path: of the file.
        identity: of the dataset that it must belong to.

    Returns:
        The outcomes, in the order of the file.

    Raises:
        ValueError: when a part that is read is damaged, or the file is of another dataset or schema.
    """
    table = _table(path, identity, ["episode", "bad", "y", "f", "stop"])
    return Outcomes(
        episode=table["episode"].to_numpy(),
        bad=_dense(table["bad"], (identity.horizon,)),
        y=table["y"].to_numpy(),
        f=table["f"].to_numpy(),
        stop=tuple(table["stop"].to_pylist()),
    )


def _table(path: Location, identity: Identity, names: list[str]) -> pa.Table:
    """Columns of a file of this dataset, every page of them checked against its checksum."""
    with _name_damage(path):
        file = pq.ParquetFile(source(path), page_checksum_verification=True, pre_buffer=True)
        require_own(path, file.schema_arrow.metadata or {}, identity)
        if not file.schema_arrow.equals(schema(identity)):
            raise ValueError(f"{path} has other columns than schema version {identity.schema_version}")
        return file.read(columns=names)


def read_stops(path: Location, identity: Identity) -> tuple[str, ...]:
    """Read the stop reasons of a file's episodes alone; raises as `read_outcomes` does.

    Args:
        path: of the file.
        identity: of the dataset that it must belong to.

    Returns:
        One reason per episode, in the order of the file; "" for none.
    """
    return tuple(_table(path, identity, ["stop"])["stop"].to_pylist())


@contextmanager
def _name_damage(path: Location) -> Iterator[None]:
    """A store that is away says nothing about the file."""
    try:
        yield
    except (pa.ArrowException, OSError) as error:
        damage = ValueError(f"{path} is damaged or no Parquet file: {error}")
        raise refusal(path, error) or damage from error


def _dense(column: pa.ChunkedArray, shape: tuple[int, ...]) -> Any:
    values = pa.chunked_array([chunk.flatten() for chunk in column.chunks], column.type.value_type)
    return values.to_numpy().reshape(len(column), *shape)


def _fields(table: pa.Table, identity: Identity) -> Iterator[tuple[str, pa.ChunkedArray]]:
    """The physics by name; what `pyarrow.compute` does as well takes long to import."""
    if identity.physics:
        struct = table["physics"]
        names = [struct.type.field(index).name for index in range(struct.type.num_fields)]
        yield from zip(names, struct.flatten(), strict=True)
