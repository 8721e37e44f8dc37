"""Shards that keep failing are put aside until their episodes are there."""

import json

import pytest

from cluster.datasets.quarantine import put_aside, quarantined_shards, release
from cluster.errors import UserError
from tests.cluster.datasets.collecting import SETTINGS, alone, collected
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import open_dataset
from workers.dataset.shards import Shard, digest_path


@pytest.mark.slow
def test_a_shard_that_was_put_aside_and_then_collected_by_another_driver_leaves_no_trace(
    ray_session, tracking_settings, tmp_path
):
    dataset = collected(tmp_path / "dataset", 4, ray_session, tracking_settings)
    errors = put_aside(dataset, dataset.shards()[0], ["its worker process died"])
    collected(tmp_path / "dataset", 4, ray_session, tracking_settings)
    assert not errors.exists()


@pytest.mark.slow
def test_a_shard_that_keeps_failing_is_put_aside_until_it_succeeds(
    ray_session, tracking_settings, tmp_path, capsys
):
    """The name of one shard's digest is taken by a folder, as a careless copy may leave it."""
    folder, blocked = tmp_path / "dataset", Shard(8, 12)
    obstacle = digest_path(folder, blocked)
    obstacle.mkdir(parents=True)
    with pytest.raises(UserError, match=rf"1 shard kept failing, {blocked.name} among them"):
        collected(folder, 12, ray_session, tracking_settings)
    dataset = open_dataset(folder)
    assert dataset.shards() == [Shard(0, 8)]
    assert quarantined_shards(dataset) == [blocked]
    kept = json.loads((folder / "quarantine" / f"{blocked.name}.json").read_text())
    assert len(kept["errors"]) == SETTINGS.attempts_per_shard
    assert all("Traceback" in text or "File " in text for text in kept["errors"])
    assert all("IsADirectoryError" in text for text in kept["errors"])
    obstacle.rmdir()
    capsys.readouterr()
    dataset = collected(folder, 20, ray_session, tracking_settings)
    assert dataset.shards() == [Shard(0, 8), Shard(8, 16), Shard(16, 20)]
    assert list((folder / "quarantine").iterdir()) == []
    assert dataset.fingerprint() == alone(tmp_path / "alone", 20).fingerprint()


@pytest.mark.slow
def test_episodes_collected_in_other_shards_are_no_longer_put_aside(tmp_path):
    dataset = alone(tmp_path, 8)
    put_aside(dataset, Shard(8, 12), ["an error"])
    assert quarantined_shards(dataset) == [Shard(8, 12)]
    assert quarantined_shards(dataset, episodes=8) == []
    release(dataset)
    assert quarantined_shards(dataset) == [Shard(8, 12)]
    collect_shard(setups.load("franka"), dataset, Shard(8, 16))
    assert quarantined_shards(dataset) == []
    release(dataset)
    assert list((tmp_path / "quarantine").iterdir()) == []
