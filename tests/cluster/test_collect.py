"""`svaedc collect` on a real cluster: pure shards, resumed, extended, refused."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cluster.collect import Tally, _note_failure, collect
from cluster.config import CollectSettings
from cluster.errors import UserError
from cluster.pool import Failed
from cluster.quarantine import quarantined, release
from cluster.tracking import open_tracker
from workers import setups
from workers.collection import collect_shard
from workers.dataset.folder import create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import WRITING, Shard
from workers.dataset.verification import verify

SETTINGS = CollectSettings(actors=2, episodes_per_shard=8)


def collected(folder: Path, episodes: int, session, tracking_settings, seed: int = 3):
    return collect(
        setup=setups.load("franka"),
        episodes=episodes,
        folder=folder,
        seed=seed,
        settings=SETTINGS,
        session=session,
        tracker=open_tracker(tracking_settings),
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
    deadline = time.monotonic() + 120
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


def test_a_folder_of_another_dataset_is_refused_naming_the_field(ray_session, tracking_settings, tmp_path):
    collected(tmp_path / "dataset", 4, ray_session, tracking_settings)
    with pytest.raises(UserError, match=r"differ in seed: 3 and 4"):
        collected(tmp_path / "dataset", 4, ray_session, tracking_settings, seed=4)


def test_more_actors_than_cpus_are_refused_before_anything_starts(ray_session, tracking_settings, tmp_path):
    with pytest.raises(UserError, match="needs 9 CPUs"):
        collect(
            setup=setups.load("franka"),
            episodes=90,
            folder=tmp_path / "dataset",
            seed=0,
            settings=CollectSettings(actors=9, episodes_per_shard=8),
            session=ray_session,
            tracker=open_tracker(tracking_settings),
        )


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
        output, _ = process.communicate(timeout=60)
    assert process.returncode == 130, output
    assert "the same command goes on" in output
    assert "Traceback" not in output
    assert not [problem for _, problems in verify(open_dataset(folder)) for problem in problems]
    assert not list((folder / WRITING).iterdir())


@pytest.mark.skipif(os.getuid() != 0, reason="only root may mount a small file system")
def test_a_full_disk_ends_the_work_with_nothing_lost(ray_session, tracking_settings, tmp_path):
    small = tmp_path / "small"
    small.mkdir()
    subprocess.run(["mount", "-t", "tmpfs", "-o", "size=700k", "tmpfs", str(small)], check=True)
    try:
        with pytest.raises(UserError, match="No space left on device"):
            collected(small, 200, ray_session, tracking_settings)
        dataset = open_dataset(small)
        assert dataset.episodes() > 0
        assert not [
            problem
            for _, problems in verify(dataset)
            for problem in problems
            if "missing" not in problem.what
        ]
        roomy = tmp_path / "roomy"
        shutil.copytree(small, roomy)
    finally:
        subprocess.run(["umount", "--lazy", str(small)], check=True)
    assert collected(roomy, 40, ray_session, tracking_settings).episodes() == 40


def test_a_shard_that_keeps_failing_is_put_aside_with_every_error(tmp_path):
    dataset = create(tmp_path, identity_of(setups.load("franka"), seed=0, episodes_per_shard=8))
    tally, shard = Tally(), Shard(8, 16)
    _note_failure(Failed(shard, "first", ValueError("first"), 1), dataset, tally)
    assert quarantined(tmp_path) == []
    _note_failure(Failed(shard, "second", ValueError("second"), 0), dataset, tally)
    assert quarantined(tmp_path) == [shard.name]
    text = (tmp_path / "quarantine" / f"{shard.name}.json").read_text()
    assert '"first"' in text
    assert '"second"' in text
    release(tmp_path, shard)
    assert quarantined(tmp_path) == []


def test_a_full_disk_is_nobodys_failed_attempt(tmp_path):
    dataset = create(tmp_path, identity_of(setups.load("franka"), seed=0, episodes_per_shard=8))
    full = OSError(errno.ENOSPC, "No space left on device")
    with pytest.raises(UserError, match="make room"):
        _note_failure(Failed(Shard(0, 8), str(full), full, 2), dataset, Tally())
