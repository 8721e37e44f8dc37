"""LeRobot exports hold the numbers of the dataset, in a format that others read without this project."""

import json

import numpy as np
import pandas
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from tests.workers.dataset.exports.columns import joined
from workers.dataset import shards
from workers.dataset.exports.lerobot import Moments, export_lerobot


def test_frames_are_the_steps_of_the_episodes_in_order(dataset, rows, tmp_path):
    assert list(export_lerobot(dataset, tmp_path)) == dataset.shards()
    files = sorted((tmp_path / "data").glob("*/*.parquet"))
    assert [path.relative_to(tmp_path).as_posix() for path in files] == [
        f"data/chunk-000/file-00{number}.parquet" for number in range(3)
    ]
    frames = pandas.concat([pandas.read_parquet(path) for path in files], ignore_index=True)
    assert len(frames) == 20 * 20
    state = np.stack(frames["observation.state"]).reshape(20, 20, 3)
    np.testing.assert_array_equal(state, joined(rows, "xi").transpose(0, 2, 1))
    np.testing.assert_array_equal(frames["bad"].to_numpy().reshape(20, 20), joined(rows, "bad"))
    assert frames["index"].tolist() == list(range(400))
    assert frames["episode_index"].tolist() == [row // 20 for row in range(400)]
    assert frames["frame_index"].tolist() == [row % 20 for row in range(400)]
    assert frames["timestamp"].to_numpy()[[0, 19, 21]] == pytest.approx([0.0, 0.038, 0.002])
    assert pq.ParquetFile(files[0]).num_row_groups == 8


def test_the_description_fits_the_frames(dataset, rows, tmp_path):
    list(export_lerobot(dataset, tmp_path))
    info = json.loads((tmp_path / "meta/info.json").read_text())
    assert (info["codebase_version"], info["fps"]) == ("v3.0", 500)
    assert (info["total_episodes"], info["total_frames"], info["total_tasks"]) == (20, 400, 1)
    assert info["features"]["observation.state"]["names"] == ["joint", "object_x", "object_y"]
    frames = pq.read_table(tmp_path / info["data_path"].format(chunk_index=0, file_index=0))
    assert set(frames.column_names) == set(info["features"])
    kinds = {"float32": pa.float32(), "uint8": pa.uint8(), "int64": pa.int64()}
    for name, feature in info["features"].items():
        kind = frames.schema.field(name).type
        assert (kind.value_type if feature["shape"] != [1] else kind) == kinds[feature["dtype"]]
    tasks = pandas.read_parquet(tmp_path / "meta/tasks.parquet")
    assert tasks["task_index"].tolist() == [0]
    stats = json.loads((tmp_path / "meta/stats.json").read_text())
    flat = joined(rows, "xi").transpose(0, 2, 1).reshape(-1, 3).astype(np.float64)
    assert stats["observation.state"]["mean"] == pytest.approx(flat.mean(axis=0), abs=1e-12)
    assert stats["observation.state"]["std"] == pytest.approx(flat.std(axis=0), abs=1e-12)
    assert stats["observation.state"]["max"] == pytest.approx(flat.max(axis=0))
    assert stats["observation.state"]["count"] == [400]


def test_each_episode_says_where_its_frames_are_and_what_it_was(dataset, rows, tmp_path):
    list(export_lerobot(dataset, tmp_path))
    files = sorted((tmp_path / "meta/episodes").glob("*/*.parquet"))
    episodes = pandas.concat([pandas.read_parquet(path) for path in files], ignore_index=True)
    task = pandas.read_parquet(tmp_path / "meta/tasks.parquet").index[0]
    assert episodes["episode_index"].tolist() == list(range(20))
    assert all(list(tasks) == [task] for tasks in episodes["tasks"])
    for _, episode in episodes.iterrows():
        place = (episode["data/chunk_index"], episode["data/file_index"])
        frames = pandas.read_parquet(tmp_path / "data" / f"chunk-{place[0]:03d}/file-{place[1]:03d}.parquet")
        own = frames[frames["episode_index"] == episode["episode_index"]]["index"].tolist()
        assert own == list(range(episode["dataset_from_index"], episode["dataset_to_index"]))
        assert len(own) == episode["length"]
    np.testing.assert_array_equal(np.stack(episodes["svaedc.x"]), joined(rows, "x"))
    np.testing.assert_array_equal(episodes["svaedc.f"], joined(rows, "f"))
    mass = np.concatenate([columns.physics["mass"] for columns in rows])
    np.testing.assert_array_equal(episodes["svaedc.physics.mass"], mass)


def test_a_dataset_with_gaps_is_numbered_without(dataset, tmp_path):
    dataset.path(shards.Shard(8, 16)).unlink()
    list(export_lerobot(dataset, tmp_path))
    files = sorted((tmp_path / "meta/episodes").glob("*/*.parquet"))
    episodes = pandas.concat([pandas.read_parquet(path) for path in files])
    assert episodes["episode_index"].tolist() == list(range(12))
    assert episodes["svaedc.episode"].tolist() == [*range(8), *range(16, 20)]


def test_moments_of_parts_are_those_of_the_whole():
    rng = np.random.default_rng(0)
    rows = 1e6 + rng.normal(size=(1000, 2))
    moments = Moments()
    for part in np.split(rows, [1, 10, 700]):
        moments.add(part)
    found = moments.as_lists()
    assert found["mean"] == pytest.approx(rows.mean(axis=0), rel=1e-14)
    assert found["std"] == pytest.approx(rows.std(axis=0), rel=1e-9)
    assert found["min"] == rows.min(axis=0).tolist()
