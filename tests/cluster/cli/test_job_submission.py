"""`ray job submit … -- svaedc …` on a head with token authentication: status, logs and stop."""

import os
import subprocess
import sys
import time
from pathlib import Path

import pyarrow.parquet as pq
import pytest

REPOSITORY = Path(__file__).parents[3]
SCRIPTS = Path(sys.executable).parent


@pytest.fixture
def job(head):
    """Runs `ray job` as a user of the head would, from the repository."""

    def run(*arguments: str) -> str:
        environment = {
            **os.environ,
            "RAY_AUTH_MODE": "token",
            "RAY_AUTH_TOKEN": head.token,
            "RAY_ADDRESS": head.dashboard,
            "HOME": str(head.home),
        }
        command = [str(SCRIPTS / "ray"), "job", *arguments]
        done = subprocess.run(
            command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, timeout=120
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout + done.stderr

    return run


def submit(job, name: str, folder: Path, episodes: int, *options: str) -> str:
    """Submits a collection; without further options it waits for the end and returns the job's log."""
    return job(
        *("submit", *options, "--submission-id", name, "--working-dir", ".", "--"),
        *(str(SCRIPTS / "svaedc"), "collect", "--setup", "franka"),
        *("--episodes", str(episodes), "--dataset", str(folder / "dataset")),
        *("--set", "collect.actors=2", "--set", "collect.episodes_per_shard=8"),
        *("--set", f"tracking.uri=sqlite:///{folder / 'mlflow.db'}"),
    )


def collected(folder: Path) -> list[int]:
    """Episode numbers of all published shards, in order."""
    tables = [pq.read_table(shard, columns=["episode"]) for shard in (folder / "dataset").rglob("*.parquet")]
    return sorted(episode for table in tables for episode in table["episode"].to_pylist())


def test_a_submitted_collection_succeeds_and_its_log_can_be_read(job, tmp_path):
    log = submit(job, "collection", tmp_path, 20)
    assert collected(tmp_path) == list(range(20)), log
    assert "succeeded" in job("status", "collection")
    assert "20 episodes" in job("logs", "collection")


@pytest.mark.slow
def test_a_stopped_collection_keeps_whole_shards(job, tmp_path):
    submit(job, "long", tmp_path, 100_000, "--no-wait")
    deadline = time.monotonic() + 300
    while not collected(tmp_path):
        assert time.monotonic() < deadline, job("logs", "long")
        time.sleep(0.2)
    job("stop", "long")
    assert "stopped" in job("status", "long")
    kept = collected(tmp_path)
    assert len(kept) == len(set(kept)) > 0
    assert len(kept) % 8 == 0
