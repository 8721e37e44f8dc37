"""The Parquet file: nothing lost, and readable without this project."""

import json
from dataclasses import replace

import numpy as np
import pandas
import pyarrow.parquet as pq
import pytest

from workers.dataset import schema


@pytest.fixture
def file(tmp_path, identity, episodes_of):
    path = tmp_path / "shard.parquet"
    schema.write(path, identity, 16, episodes_of(identity, range(16, 24)))
    return path


def test_episodes_survive_the_round_trip_bit_for_bit(file, identity, episodes_of):
    columns = schema.read(file, identity)
    for row, episode in enumerate(episodes_of(identity, range(16, 24))):
        assert columns.episode[row] == 16 + row
        assert columns.x[row].tobytes() == episode.x.tobytes()
        assert columns.xi[row].tobytes() == episode.xi.tobytes()
        assert columns.bad[row].tobytes() == episode.bad.tobytes()
        assert columns.y[row] == np.float32(episode.y)
        assert columns.f[row] == episode.f
        assert columns.stop[row] == episode.stop
        assert {name: values[row] for name, values in columns.physics.items()} == episode.physics


def test_more_episodes_than_a_row_group_keep_their_order(tmp_path, identity, episodes_of):
    path = tmp_path / "long.parquet"
    schema.write(path, identity, 0, episodes_of(identity, range(150)))
    assert schema.read(path, identity).episode.tolist() == list(range(150))
    assert pq.ParquetFile(path).num_row_groups == 3
    assert schema.read_stops(path, identity) == schema.read(path, identity).stop


def test_a_stranger_with_pandas_understands_the_file(file, identity, episodes_of):
    table = pandas.read_parquet(file)
    metadata = pq.read_schema(file).metadata
    described = json.loads(metadata[b"svaedc.identity"])
    layout = json.loads(metadata[b"svaedc.layout"])
    xi = np.stack(table["xi"]).reshape(-1, *layout["xi_shape"])
    expected = episodes_of(identity, range(16, 24))
    assert layout["xi"] == ["observation", "time"]
    assert [name for name, *_ in described["observation"]] == ["joint", "object_x", "object_y"]
    assert [unit for _, unit, *_ in described["observation"]] == ["rad", "m", "m"]
    assert described["control_step"] == 0.002
    assert np.array_equal(xi, np.stack([episode.xi for episode in expected]))
    assert table["physics"][0]["mass"] == expected[0].physics["mass"]
    assert table["stop"].tolist() == [episode.stop for episode in expected]


def test_the_same_episodes_give_the_same_bytes(tmp_path, identity, episodes_of):
    files = [tmp_path / name for name in ("one", "other")]
    for path in files:
        schema.write(path, identity, 0, episodes_of(identity, range(8)))
    assert files[0].read_bytes() == files[1].read_bytes()


def test_the_order_in_which_physics_is_declared_does_not_matter(file, identity):
    """A dataset opened again has read its identity from JSON with sorted keys."""
    reopened = type(identity).from_json(identity.to_json())
    assert list(reopened.physics) != list(identity.physics)
    assert schema.read(file, reopened).episode.tolist() == list(range(16, 24))
    assert schema.read_identity(file) == identity


@pytest.mark.parametrize("keep", [0, 3, 100, -1])
def test_a_truncated_file_is_refused_by_name(file, identity, keep):
    file.write_bytes(file.read_bytes()[:keep])
    with pytest.raises(ValueError, match=r"shard\.parquet is damaged"):
        schema.read(file, identity)


def test_a_flipped_byte_in_the_data_is_refused_by_name(file, identity):
    content = bytearray(file.read_bytes())
    meta = pq.ParquetFile(file).metadata.row_group(0).column(2)
    content[meta.data_page_offset + meta.total_compressed_size - 5] ^= 0x40
    file.write_bytes(content)
    with pytest.raises(ValueError, match=r"shard\.parquet is damaged"):
        schema.read(file, identity)


def test_a_file_of_other_columns_is_refused(file, identity):
    table = pq.read_table(file)
    pq.write_table(table.set_column(4, "y", table["y"].cast("float64")), file)
    with pytest.raises(ValueError, match="other columns than schema version 1"):
        schema.read(file, identity)


def test_a_file_of_another_dataset_is_refused_whatever_its_columns(file, identity):
    with pytest.raises(ValueError, match=r"belongs to another dataset; .* differ in horizon: 20 and 40"):
        schema.read(file, replace(identity, horizon=40))


def test_a_parquet_file_from_elsewhere_is_refused(tmp_path):
    path = tmp_path / "foreign.parquet"
    pandas.DataFrame({"a": [1]}).to_parquet(path)
    with pytest.raises(ValueError, match=r"foreign\.parquet holds no episodes"):
        schema.read_identity(path)
