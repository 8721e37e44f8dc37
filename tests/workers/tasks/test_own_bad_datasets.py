"""Datasets of a user's own G_bad: exact degrees, checked, and never mixed with others."""

import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.cache import training_cache
from workers.dataset.folder import create
from workers.dataset.identity import Identity, identity_of
from workers.dataset.shards import Shard
from workers.dataset.statistics import statistics
from workers.dataset.verification import verify
from workers.setups.user_bad import with_bad

pytestmark = pytest.mark.usefixtures("gentle")


@pytest.fixture(scope="session")
def franka():
    """The Franka as it ships: the order of episodes is tried in a process that loads it by its name."""
    return setups.load("franka")


@pytest.fixture
def dataset(franka, tmp_path):
    """Six episodes under the graded G_bad `rough`."""
    setup = with_bad(franka, "gentle:rough")
    created = create(tmp_path / "dataset", identity_of(setup, seed=0, episodes_per_shard=4))
    for shard in created.missing(6):
        collect_shard(setup, created, shard)
    return created


@pytest.mark.slow
def test_a_graded_dataset_gives_training_its_degrees_and_exact_y(dataset, episode, tmp_path):
    assert [found for _, found in verify(dataset)] == [[], []]
    cache = training_cache(dataset, 5, tmp_path / "cache")
    for row in range(6):
        expected = episode("rough", row)
        assert np.array_equal(cache.bad[row], expected.bad[4::5])
        assert cache.y[row] == np.float32(expected.y)
    means = [episode("rough", row).y for row in range(6)]
    assert statistics(dataset).bad_steps == pytest.approx({"rough": np.mean(means)})
    metadata = pq.read_schema(dataset.path(Shard(0, 4))).metadata
    assert json.loads(metadata[b"svaedc.layout"])["bad"] == "degree of badness of each step, in [0, 1]"


def test_degrees_that_were_tampered_with_are_found(dataset):
    table = pq.read_table(dataset.path(Shard(0, 4)))
    bad = dataset.read(Shard(0, 4)).bad.reshape(-1).copy()
    bad[0] = 7.0
    field = table.schema.field("bad")
    column = pa.FixedSizeListArray.from_arrays(pa.array(bad), type=field.type)
    changed = table.set_column(table.schema.get_field_index("bad"), field, column)
    pq.write_table(changed, dataset.path(Shard(0, 4)))
    found = [problem.what for _, problems in verify(dataset) for problem in problems]
    assert "it holds degrees of badness outside [0, 1]" in found
    assert "y is not the mean of the bad steps" in found


def test_datasets_of_different_functions_never_mix(dataset, franka):
    assert Identity.from_json(dataset.identity.to_json()) == dataset.identity
    for name, message in (
        ("gentle:flipped", "differ in .*bad_name: gentle:rough and gentle:flipped"),
        ("", "differ in .*bad_kind: graded and bits"),
    ):
        other = identity_of(with_bad(franka, name), seed=0, episodes_per_shard=4)
        with pytest.raises(ValueError, match=message):
            create(dataset.folder, other)
