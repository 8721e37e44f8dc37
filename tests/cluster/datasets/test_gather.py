"""What counts as a failed attempt of a shard, and what does not."""

import errno
import os

import pytest

from cluster.datasets.gather import note_failure
from cluster.datasets.progress import CollectionProgress
from cluster.errors import UserError
from cluster.runtime.actor_pool import Failed
from workers import setups
from workers.dataset.folder import create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.ESTALE])
def test_a_failing_disk_is_no_shards_failed_attempt(tmp_path, number):
    dataset = create(tmp_path, identity_of(setups.load("franka"), seed=0, episodes_per_shard=8))
    cause = OSError(number, os.strerror(number))
    with pytest.raises(UserError, match=rf"{os.strerror(number)}.*make room"):
        note_failure(Failed(Shard(0, 8), str(cause), str(cause), cause, 2), dataset, CollectionProgress())
    assert not (tmp_path / "quarantine").exists()
