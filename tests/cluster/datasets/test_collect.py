"""`svaedc collect` on a real cluster: pure shards, resumed, extended, refused."""

import errno
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cluster.cli.dataset import info
from cluster.config import CollectSettings
from cluster.datasets.collect import collect
from cluster.datasets.gather import note_failure, rollout_pool
from cluster.datasets.plan import plan_collection
from cluster.datasets.progress import CollectionProgress, ProgressRecorder
from cluster.datasets.quarantine import put_aside, quarantined_shards, release
from cluster.datasets.worker import RolloutActor
from cluster.errors import UserError
from cluster.runtime.actor_pool import Failed
from cluster.tracking import open_tracker
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import MANIFEST, create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.inventory import inventory
from workers.dataset.shards import Shard, digest_path
from workers.dataset.storage.temporary import WRITING, host, writer
from workers.dataset.verification import verify

SETTINGS = CollectSettings(actors=2, episodes_per_shard=8)


def collected(folder: Path, episodes: int, session, tracking_settings, seed: int = 3):
    return collect(
        plan_collection(
            setup=setups.load("franka"), episodes=episodes, folder=folder, seed=seed, settings=SETTINGS
        ),
        SETTINGS,
        session,
        open_tracker(tracking_settings),
    )


def alone(folder: Path, episodes: int, seed: int = 3):
    """The same dataset, made in this process."""
    setup = setups.load("franka")
    dataset = create(folder, identity_of(setup, seed=seed, episodes_per_shard=8))
    for shard in dataset.missing(episodes):
        collect_shard(setup, dataset, shard)
    return dataset


def command(folder: Path, store: Path, episodes: int) -> list[str]:
    return [
        *(sys.executable, "-m", "cluster", "collect", "--setup", "franka", "--dataset", str(folder)),
        *("--episodes", str(episodes), "--seed", "3", "--set", "collect.episodes_per_shard=8"),
        *("--set", f"tracking.uri=sqlite:///{store}", "--set", "ray.num_cpus=2"),
    ]


def wait_for_shards(folder: Path, count: int, process: subprocess.Popen[str]) -> None:
    deadline = time.monotonic() + 300
    while len(list(folder.glob("*.parquet"))) < count:
        assert process.poll() is None, process.communicate()
        assert time.monotonic() < deadline
        time.sleep(0.05)


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


def test_repeats_are_collected_by_any_worker_and_described(tmp_path, capsys):
    identity = identity_of(setups.load("franka"), seed=3, episodes_per_shard=8, repeats=3)
    dataset = create(tmp_path, identity)
    worker = RolloutActor("franka", str(tmp_path))
    for shard in dataset.missing(12):
        worker.collect(shard)
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    controllers = np.concatenate([columns.x for _, columns in dataset.batches()])
    assert len(np.unique(controllers, axis=0)) == 4
    info(tmp_path)
    described = capsys.readouterr().out
    assert "3 of each controller" in described
    assert "of the variance of y" in described


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


def test_a_shard_that_was_put_aside_and_then_collected_by_another_driver_leaves_no_trace(
    ray_session, tracking_settings, tmp_path
):
    dataset = collected(tmp_path / "dataset", 4, ray_session, tracking_settings)
    errors = put_aside(dataset, dataset.shards()[0], ["its worker process died"])
    collected(tmp_path / "dataset", 4, ray_session, tracking_settings)
    assert not errors.exists()


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
def test_a_killed_driver_is_continued_to_the_same_bytes(tmp_path):
    folder, store = tmp_path / "dataset", tmp_path / "mlflow.db"
    with subprocess.Popen(
        command(folder, store, 160), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as first:
        wait_for_shards(folder, 3, first)
        first.kill()
    assert open_dataset(folder).episodes() < 160
    again = subprocess.run(command(folder, store, 160), capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr
    dataset = open_dataset(folder)
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    assert dataset.fingerprint() == alone(tmp_path / "alone", 160).fingerprint()
    assert not list((folder / WRITING).iterdir())


def test_ctrl_c_ends_cleanly_and_says_how_to_go_on(tmp_path):
    folder, store = tmp_path / "dataset", tmp_path / "mlflow.db"
    with subprocess.Popen(
        command(folder, store, 4000), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    ) as process:
        wait_for_shards(folder, 1, process)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=180)
    assert process.returncode == 130, output
    assert "the same command goes on" in output
    assert "Traceback" not in output
    assert not [problem for _, problems in verify(open_dataset(folder)) for problem in problems]
    assert not list((folder / WRITING).iterdir())


def test_a_full_disk_ends_the_work_with_nothing_lost(ray_session, tracking_settings, tmp_path):
    small = tmp_path / "small"
    small.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=700k", "tmpfs", str(small)]
    mounted = subprocess.run(mount, capture_output=True, text=True, check=False)
    if mounted.returncode:
        pytest.skip(f"a small file system cannot be mounted here: {mounted.stderr.strip()}")
    try:
        with pytest.raises(UserError, match="No space left on device"):
            collected(small, 200, ray_session, tracking_settings)
        dataset = open_dataset(small)
        assert dataset.episodes() > 0
        assert not [problem for _, problems in verify(dataset) for problem in problems]
        roomy = tmp_path / "roomy"
        shutil.copytree(small, roomy)
    finally:
        subprocess.run(["umount", "--lazy", str(small)], check=True)
    assert collected(roomy, 40, ray_session, tracking_settings).episodes() == 40


def test_a_shard_that_keeps_failing_is_put_aside_until_it_succeeds(
    ray_session, tracking_settings, tmp_path, capsys
):
    """The name of one shard's digest is taken by a folder, as a careless copy may leave it."""
    folder, blocked = tmp_path / "dataset", Shard(8, 12)
    obstacle = digest_path(folder, blocked)
    obstacle.mkdir(parents=True)
    with pytest.raises(UserError, match=rf"1 shards kept failing, {blocked.name} among them"):
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


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.ESTALE])
def test_a_failing_disk_is_no_shards_failed_attempt(tmp_path, number):
    dataset = create(tmp_path, identity_of(setups.load("franka"), seed=0, episodes_per_shard=8))
    cause = OSError(number, os.strerror(number))
    with pytest.raises(UserError, match=rf"{os.strerror(number)}.*make room"):
        note_failure(Failed(Shard(0, 8), str(cause), str(cause), cause, 2), dataset, CollectionProgress())
    assert not (tmp_path / "quarantine").exists()


@pytest.mark.usefixtures("ray_session")
def test_a_machine_with_other_libraries_collects_nothing_and_names_them(tmp_path):
    identity = identity_of(setups.load("franka"), seed=0, episodes_per_shard=8)
    dataset = create(tmp_path / "dataset", replace(identity, numpy="1.0", pybullet="2.0"))
    differ = rf"{host()} would roll out other episodes .* differ in pybullet: 2\.0 and .*numpy: 1\.0"
    with pytest.raises(ValueError, match=differ):
        RolloutActor("franka", str(dataset.folder))
    with (
        pytest.raises(UserError, match=rf"cannot start: ValueError: the machine {differ}"),
        rollout_pool(dataset, SETTINGS, 1) as pool,
    ):
        list(pool.run([Shard(0, 8)]))
    assert sorted(path.name for path in dataset.folder.iterdir()) == [WRITING, MANIFEST]


def test_an_mlflow_store_that_fails_meanwhile_does_not_end_the_collection(tracking_settings, capsys):
    """Its file is damaged for a while: what is recorded later is there."""
    tracker = open_tracker(tracking_settings)
    database = Path(tracker.uri.removeprefix("sqlite:///"))
    counts = CollectionProgress(episodes=8)
    with tracker.run("collect", "collect", {}) as run:
        recorder = ProgressRecorder(run, interval=0.0)
        content = database.read_bytes()
        database.write_bytes(b"damaged" * 1000)
        recorder.record(counts)
        recorder.record(counts)
        with pytest.raises(UserError, match="cannot be used"):
            run.metrics(counts.metrics(), step=8)
        database.write_bytes(content)
        recorder.record(counts)
        assert tracker.client.get_run(run.id).data.metrics["episodes"] == 8
    assert capsys.readouterr().err.count("the collection goes on") == 1


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


def test_a_rollout_process_stores_as_its_dataset_says(tmp_path):
    identity = identity_of(setups.load("franka"), seed=0, episodes_per_shard=2, repeats=2, storage="int16")
    dataset = create(tmp_path / "dataset", identity)
    RolloutActor("franka", str(dataset.folder)).collect(Shard(0, 2))
    assert not [problem for _, problems in verify(dataset) for problem in problems]
    assert pq.read_schema(dataset.path(Shard(0, 2))).field("xi").type.value_type == pa.int16()
