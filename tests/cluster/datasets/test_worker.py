"""A rollout process collects what its dataset says, or nothing."""

from dataclasses import replace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cluster.cli.dataset import info
from cluster.datasets.gather import rollout_pool
from cluster.datasets.worker import RolloutActor
from cluster.errors import UserError
from tests.cluster.datasets.collecting import SETTINGS
from workers import setups
from workers.dataset.folder import MANIFEST, create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import WRITING, host
from workers.dataset.verification import verify


def test_repeats_are_collected_by_any_worker_and_described(tmp_path, capsys):
    identity = identity_of(setups.load("franka"), seed=3, episodes_per_shard=8, repeats=3)
    dataset = create(tmp_path, identity)
    worker = RolloutActor("franka", str(tmp_path), 60.0)
    for shard in dataset.missing(12):
        worker.collect(shard)
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    controllers = np.concatenate([columns.x for _, columns in dataset.batches()])
    assert len(np.unique(controllers, axis=0)) == 4
    info(tmp_path)
    described = capsys.readouterr().out
    assert "3 of each controller" in described
    assert "of the variance of y" in described


@pytest.mark.usefixtures("ray_session")
def test_a_machine_with_other_libraries_collects_nothing_and_names_them(tmp_path):
    identity = identity_of(setups.load("franka"), seed=0, episodes_per_shard=8)
    dataset = create(tmp_path / "dataset", replace(identity, numpy="1.0", pybullet="2.0"))
    differ = rf"{host()} would roll out other episodes .* differ in pybullet: 2\.0 and .*numpy: 1\.0"
    with pytest.raises(ValueError, match=differ):
        RolloutActor("franka", str(dataset.folder), 60.0)
    with (
        pytest.raises(UserError, match=rf"cannot start: ValueError: the machine {differ}"),
        rollout_pool(dataset, SETTINGS, 1) as pool,
    ):
        list(pool.run([Shard(0, 8)]))
    assert sorted(path.name for path in dataset.folder.iterdir()) == [WRITING, MANIFEST]


def test_a_rollout_process_stores_as_its_dataset_says(tmp_path):
    identity = identity_of(setups.load("franka"), seed=0, episodes_per_shard=2, repeats=2, storage="int16")
    dataset = create(tmp_path / "dataset", identity)
    RolloutActor("franka", str(dataset.folder), 60.0).collect(Shard(0, 2))
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    assert pq.read_schema(dataset.path(Shard(0, 2))).field("xi").type.value_type == pa.int16()
