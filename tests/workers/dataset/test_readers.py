"""The files explain themselves: other people's tools read a dataset's folder without this project's code."""

import json
from pathlib import Path

import duckdb
import numpy as np
import pandas
import polars
import pyarrow.parquet as pq
import pytest
import ray


@pytest.fixture
def folder(dataset) -> Path:
    """A folder as a collection leaves it, with everything that may lie beside the shards."""
    (dataset.folder / "quarantine").mkdir()
    (dataset.folder / "quarantine" / "episodes-000000024-000000032.parquet.json").write_text("{}")
    (dataset.folder / "plan.json").write_text("{}")
    (dataset.folder / ".replaced").mkdir()
    (dataset.folder / ".replaced" / "episodes-000000000-000000008.parquet.0123").write_bytes(b"broken")
    return dataset.folder


def test_pandas_reads_the_files_and_their_metadata_says_what_is_in_them(folder, dataset):
    paths = sorted(folder.glob("*.parquet"))
    frame = pandas.concat([pandas.read_parquet(path) for path in paths], ignore_index=True)
    identity = json.loads(pq.read_schema(paths[0]).metadata[b"svaedc.identity"])
    shape = (len(identity["observation"]), identity["horizon"])
    [first, *_] = dataset.batches()
    np.testing.assert_array_equal(frame.xi[3].reshape(shape), first[1].xi[3])
    assert frame.episode.tolist() == list(range(20))
    assert frame.physics[3]["mass"] == first[1].physics["mass"][3]
    assert identity["observation"][1][:2] == ["object_x", "m"]


def test_duckdb_queries_the_folder(folder, dataset):
    query = f"""
        select count(*), avg(f), max(physics.mass), count(*) filter (stop = 'diverged')
        from '{folder}/*.parquet'
    """
    [(count, mean, mass, diverged)] = duckdb.sql(query).fetchall()
    columns = [columns for _, columns in dataset.batches()]
    assert count == 20
    assert mean == pytest.approx(np.concatenate([each.f for each in columns]).mean(dtype=np.float64))
    assert mass == max(each.physics["mass"].max() for each in columns)
    assert diverged == 3


def test_polars_scans_the_folder(folder, dataset):
    table = polars.scan_parquet(folder / "*.parquet")
    found = table.filter(polars.col("y") > 0.5).select("episode", polars.col("xi").arr.get(21)).collect()
    expected = [
        (int(index), float(xi[1, 1]))
        for _, columns in dataset.batches()
        for index, xi, y in zip(columns.episode, columns.xi, columns.y, strict=True)
        if y > 0.5
    ]
    assert sorted(found.rows()) == expected


@pytest.mark.usefixtures("ray_session")
def test_ray_data_reads_the_folder(folder, dataset):
    read = ray.data.read_parquet([str(path) for path in sorted(folder.glob("*.parquet"))])
    rows = sorted(read.select_columns(["episode", "x", "f"]).take_all(), key=lambda row: row["episode"])
    columns = [columns for _, columns in dataset.batches()]
    np.testing.assert_array_equal([row["x"] for row in rows], np.concatenate([each.x for each in columns]))
    assert [row["f"] for row in rows] == pytest.approx(np.concatenate([each.f for each in columns]))
