"""A rollout process under a user's own G_bad."""

import sys

import numpy as np
import pytest

from cluster.datasets.worker import RolloutActor
from tests.gentle import SOURCE
from workers import setups
from workers.dataset.folder import create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.setups.user_bad import with_bad

pytestmark = pytest.mark.usefixtures("gentle")


def test_a_worker_loads_the_function_by_its_name_and_refuses_another_file(tmp_path, gentle, monkeypatch):
    setup = with_bad(setups.load("franka"), "gentle:rough")
    dataset = create(tmp_path / "dataset", identity_of(setup, seed=0, episodes_per_shard=2))
    RolloutActor("franka", str(dataset.folder), 60.0).collect(Shard(0, 2))
    assert dataset.read(Shard(0, 2)).bad.dtype == np.float32
    gentle.write_text(SOURCE.replace("200 * x", "201 * x"))
    monkeypatch.delitem(sys.modules, "gentle")
    with pytest.raises(ValueError, match=r"would roll out other episodes .* differ in bad_digest: "):
        RolloutActor("franka", str(dataset.folder), 60.0)


def test_a_worker_tries_the_function_before_it_takes_a_shard(tmp_path):
    setup = with_bad(setups.load("franka"), "gentle:too_large")
    dataset = create(tmp_path / "dataset", identity_of(setup, seed=0, episodes_per_shard=2))
    with pytest.raises(ValueError, match=r"gentle:too_large must return numbers in \[0, 1\], got 1\.5"):
        RolloutActor("franka", str(dataset.folder), 60.0)
