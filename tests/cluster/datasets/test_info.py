"""What is told of a dataset, line by line."""

import pytest

from cluster.datasets.info import dataset_info
from cluster.datasets.quarantine import put_aside
from cluster.errors import UserError
from tests.cluster.datasets.collecting import alone
from workers.dataset.shards import Shard


def test_the_lines_count_what_the_dataset_holds(tmp_path):
    dataset = alone(tmp_path, 3)
    told = dataset_info(dataset)
    assert told["episodes"] == "3 in 1 shard"
    assert told["each"] == "500 steps of 2 ms"
    assert told["G_bad"] == "the setup's own, bits"
    assert told["fingerprint"] == dataset.fingerprint()
    assert told["put aside"] == "none"
    best = max(f for _, columns in dataset.batches() for f in columns.f)
    assert f"{best:+.2f}  (min, 5, 25, 50, 75, 95 %, max)" in told["objective"]


def test_an_empty_dataset_has_no_statistics_and_names_what_is_put_aside(tmp_path):
    dataset = alone(tmp_path, 0)
    put_aside(dataset, Shard(0, 8), ["it failed"])
    told = dataset_info(dataset)
    assert told["episodes"] == "0 in 0 shards"
    assert told["put aside"] == Shard(0, 8).name
    assert "objective" not in told


def test_a_shard_that_cannot_be_read_is_an_error_with_the_command_that_lists_all(tmp_path):
    dataset = alone(tmp_path, 1)
    dataset.path(dataset.shards()[0]).write_bytes(b"damaged")
    with pytest.raises(UserError, match=r"`svaedc dataset verify .*` lists everything that is wrong"):
        dataset_info(dataset)
