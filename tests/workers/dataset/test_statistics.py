"""What a dataset is like, counted over episodes however they are cut into files."""

import numpy as np
import pytest

from workers.dataset import schema, shards
from workers.dataset.folder import create
from workers.dataset.shards import Shard
from workers.dataset.statistics import MARKS, statistics


def test_every_episode_counts_alike_in_a_dataset_with_a_partial_shard(dataset, identity, episodes_of):
    """Three shards of 8, 8 and 4 episodes."""
    episodes = episodes_of(identity, range(20))
    found = statistics(dataset)
    bits = np.stack([episode.bad for episode in episodes])
    assert found.badness == pytest.approx(np.mean([episode.y for episode in episodes]))
    assert found.bad_steps == pytest.approx(
        {"tipped": (bits & 1).astype(bool).mean(), "off_table": (bits & 2).astype(bool).mean()}
    )
    assert found.objective == pytest.approx(np.quantile([episode.f for episode in episodes], MARKS))
    assert (found.diverged, found.stopped) == (3, {})


def test_stopped_episodes_are_counted_by_their_reason_and_not_as_diverged(guarded):
    found = statistics(guarded)
    assert (found.diverged, found.stopped) == (2, {"too far": 3})
    assert found.bad_steps["stopped"] == pytest.approx((2 * 20 + 3 * 9) / (16 * 20))


def test_a_lopsided_partial_shard_weighs_no_more_than_its_rows(tmp_path, identity, episodes_of):
    lopsided = create(tmp_path / "lopsided", identity)
    for shard, bad in ((Shard(0, 8), 0), (Shard(8, 10), 1)):
        rows = episodes_of(identity, range(shard.start, shard.stop))
        for row in rows:
            row.bad[:] = bad
        shards.commit(
            lopsided.folder,
            shard,
            lambda path, rows=rows, start=shard.start: schema.write(path, identity, start, rows),
        )
    assert statistics(lopsided).bad_steps == pytest.approx({"tipped": 0.2, "off_table": 0.0})


def test_a_dataset_without_episodes_has_no_statistics(tmp_path, identity):
    with pytest.raises(ValueError, match="holds no episodes yet"):
        statistics(create(tmp_path / "empty", identity))


def test_a_damaged_shard_is_refused_by_name(dataset):
    path = dataset.path(Shard(8, 16))
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(ValueError, match=rf"{path.name} is damaged"):
        statistics(dataset)
