"""A collection that is interrupted goes on to the same bytes."""

import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cluster.errors import UserError
from tests.cluster.datasets.collecting import alone, collected
from workers.dataset.folder import open_dataset
from workers.dataset.storage.temporary import WRITING
from workers.dataset.verification import verify


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


@pytest.mark.slow
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


@pytest.mark.slow
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
