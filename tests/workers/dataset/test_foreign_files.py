"""Files of another dataset, or under another name, are refused wherever their rows are read."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from workers.dataset import schema, shards
from workers.dataset.cache import training_cache
from workers.dataset.exports.npz import export_npz
from workers.dataset.folder import Dataset, create
from workers.dataset.shards import Shard
from workers.dataset.statistics import statistics

MIDDLE, NEXT = Shard(8, 16), Shard(20, 28)
READERS = {
    "episodes": lambda dataset, _: [dataset.read(shard) for shard in dataset.shards()],
    "an episode": lambda dataset, _: [dataset.episode(index) for index in (9, 21)],
    "statistics": lambda dataset, _: statistics(dataset),
    "a cache": lambda dataset, folder: training_cache(dataset, 5, folder),
    "an export": lambda dataset, folder: list(export_npz(dataset, folder)),
}


def put(dataset: Dataset, shard: Shard, file: Path) -> None:
    """Copy a file to the name of a shard, with a digest that fits."""
    shards.digest_path(dataset.folder, shard).unlink(missing_ok=True)
    dataset.path(shard).unlink(missing_ok=True)
    shards.commit(dataset.folder, shard, lambda path: path.write_bytes(file.read_bytes()))


@pytest.fixture
def graded_of(episodes_of):
    """(identity, indices) -> the same episodes, with degrees of badness if the identity has them."""

    def episodes(identity, indices):
        plain = episodes_of(identity, indices)
        if identity.bad_kind == "bits":
            return plain
        return [replace(each, bad=(each.bad != 0).astype(np.float32)) for each in plain]

    return episodes


@pytest.fixture
def made(tmp_path, graded_of):
    """(name, identity) -> a dataset of 20 episodes in three shards."""

    def dataset(name, identity):
        created = create(tmp_path / name, identity)
        for shard in created.missing(20):
            rows = graded_of(identity, range(shard.start, shard.stop))
            shards.commit(
                created.folder,
                shard,
                lambda path, rows=rows, start=shard.start: schema.write(path, identity, start, rows),
            )
        return created

    return dataset


@pytest.mark.parametrize("reader", sorted(READERS))
@pytest.mark.parametrize(("field", "value"), [("seed", 7), ("setup", "toy-rehearsal")])
def test_a_shard_of_another_dataset_is_refused_by_name_with_what_differs(
    dataset, made, tmp_path, identity, reader, field, value
):
    put(dataset, MIDDLE, made("other", replace(identity, **{field: value})).path(MIDDLE))
    message = f"{MIDDLE.name} belongs to another dataset; .* {field}: {value} and .*svaedc dataset verify"
    with pytest.raises(ValueError, match=message):
        READERS[reader](dataset, tmp_path)


@pytest.mark.parametrize("reader", sorted(READERS))
def test_a_shard_under_the_name_of_another_is_refused_by_name(dataset, tmp_path, reader):
    put(dataset, NEXT, dataset.path(Shard(0, 8)))
    message = f"{NEXT.name} must hold the episodes 20 to 27 of its name, got 0 to 7; .*svaedc dataset verify"
    with pytest.raises(ValueError, match=message):
        READERS[reader](dataset, tmp_path)


@pytest.mark.parametrize(
    "change",
    [{"storage": "int16"}, {"bad_kind": "graded", "conditions": ("rough",)}, {"repeats": 4}],
    ids=lambda change: next(iter(change)),
)
def test_every_kind_of_dataset_knows_its_own_files_from_others(dataset, made, tmp_path, identity, change):
    own = made("own", replace(identity, **change))
    assert len(training_cache(own, 5, tmp_path / "cache").episode) == 17
    put(dataset, MIDDLE, own.path(MIDDLE))
    with pytest.raises(ValueError, match=f"belongs to another dataset; .* {next(iter(change))}: "):
        dataset.read(MIDDLE)


def test_an_equal_identity_in_another_spelling_is_no_other_dataset(dataset):
    """A digest is of a text; what counts is what the text says."""
    path = dataset.path(MIDDLE)
    table = pq.read_table(path)
    metadata = table.schema.metadata | {b"svaedc.digest": b"of another spelling"}
    pq.write_table(table.replace_schema_metadata(metadata), path)
    assert dataset.read(MIDDLE).episode.tolist() == list(range(8, 16))
