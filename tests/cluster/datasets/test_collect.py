"""`svaedc collect` on a real cluster: pure shards, extended, refused."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from cluster.config import CollectSettings
from cluster.datasets.collect import collect
from cluster.datasets.plan import plan_collection
from cluster.errors import UserError
from cluster.tracking import open_tracker
from tests.cluster.datasets.collecting import alone, collected
from workers import setups
from workers.dataset.folder import create
from workers.dataset.identity import identity_of
from workers.dataset.inventory import inventory
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import WRITING, writer
from workers.dataset.verification import verify


def test_a_cluster_collects_the_bytes_that_one_process_would(ray_session, tracking_settings, tmp_path):
    dataset = collected(tmp_path / "cluster", 20, ray_session, tracking_settings)
    assert [shard.name[9:28] for shard in dataset.shards()] == [
        "000000000-000000008",
        "000000008-000000016",
        "000000016-000000020",
    ]
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    assert dataset.fingerprint() == alone(tmp_path / "alone", 20).fingerprint()
    assert not list((tmp_path / "cluster" / WRITING).iterdir())


@pytest.mark.slow
def test_extending_rewrites_nothing_and_asking_again_does_nothing(
    ray_session, tracking_settings, tmp_path, capsys
):
    folder = tmp_path / "dataset"
    collected(folder, 12, ray_session, tracking_settings)
    before = {path: path.stat().st_mtime_ns for path in folder.glob("*.parquet")}
    dataset = collected(folder, 20, ray_session, tracking_settings)
    assert dataset.episodes() == 20
    assert all(path.stat().st_mtime_ns == moment for path, moment in before.items())
    capsys.readouterr()
    collected(folder, 20, ray_session, tracking_settings)
    assert "nothing to do" in capsys.readouterr().err


@pytest.mark.slow
def test_a_folder_of_another_dataset_is_refused_naming_the_field(ray_session, tracking_settings, tmp_path):
    collected(tmp_path / "dataset", 4, ray_session, tracking_settings)
    with pytest.raises(UserError, match=r"differ in seed: 3 and 4"):
        collected(tmp_path / "dataset", 4, ray_session, tracking_settings, seed=4)


def test_more_actors_than_cpus_are_refused_before_anything_starts(ray_session, tracking_settings, tmp_path):
    with pytest.raises(UserError, match="needs 9 CPUs"):
        collect(
            plan_collection(
                setup=setups.load("franka"),
                episodes=90,
                folder=tmp_path / "dataset",
                seed=0,
                settings=CollectSettings(actors=9, episodes_per_shard=8),
            ),
            CollectSettings(actors=9, episodes_per_shard=8),
            ray_session,
            open_tracker(tracking_settings),
        )


@pytest.mark.slow
def test_two_drivers_on_one_dataset_lose_and_double_nothing(ray_session, tracking_settings, tmp_path):
    """And what a living process is writing meanwhile stays.

    The drivers are threads of one process, which begins the dataset once: its unfinished files bear one name.
    """
    folder = tmp_path / "dataset"
    create(folder, identity_of(setups.load("franka"), seed=3, episodes_per_shard=8))
    unfinished = folder / WRITING / f"{Shard(96, 104).name}.{writer()}"
    unfinished.write_bytes(b"half")
    with ThreadPoolExecutor(2) as threads:
        drivers = [threads.submit(collected, folder, 20, ray_session, tracking_settings) for _ in range(2)]
        datasets = [driver.result() for driver in drivers]
    assert datasets[0] == datasets[1]
    assert datasets[0].missing(20) == []
    assert not [problem for _, problems in verify(datasets[0]) for problem in problems]
    assert list(inventory(datasets[0])) == []
    assert datasets[0].fingerprint() == alone(tmp_path / "alone", 20).fingerprint()
    assert list(unfinished.parent.iterdir()) == [unfinished]
