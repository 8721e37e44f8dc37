"""A robot of a user's own that raises, hangs and ends its process, from the command line."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from tests.own_robot import write_robot
from workers.attempts import Attempts
from workers.dataset.folder import open_dataset
from workers.dataset.verification import verify
from workers.episode import FAILED
from workers.rollout import draw

ACT = """    def act(self, force):
        if force > 0.97:
            import os

            os.abort()
        if force > 0.94:
            raise KeyError("puck")
        if force < -0.985:
            import time

            time.sleep(1000)
        return force

    def record(self):"""
SEED = "28"
"""Of its first 32 episodes, one hangs, one raises, and one ends its process."""
SETTINGS = ("tracking.uri=sqlite:///mlflow.db", "ray.num_cpus=2", "collect.episodes_per_shard=16")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    made = tmp_path_factory.mktemp("deadly")
    write_robot(made, "sound")
    write_robot(
        made, "deadly", ("force = command[0]", "force = self.act(command[0])"), ("    def record(self):", ACT)
    )
    return made


def svaedc(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [str(Path(sys.executable).parent / "svaedc"), *arguments]
    command += [word for setting in SETTINGS for word in ("--set", setting)]
    return subprocess.run(command, capture_output=True, text=True, encoding="utf-8", cwd=folder)


@pytest.mark.slow
def test_a_collection_loses_the_episodes_that_failed_and_no_other(folder, monkeypatch):
    collect = ("collect", "--setup", "deadly", "--episodes", "32", "--dataset", "data", "--seed", SEED)
    done = svaedc(folder, *collect, "--set", "collect.episode_timeout_seconds=3")
    assert done.returncode == 0, done.stderr
    dataset = open_dataset(folder / "data")
    assert [problem for _, problems in verify(dataset) for problem in problems] == []
    monkeypatch.syspath_prepend(folder)
    import sound

    setup = sound.setup()
    expected = []
    with Attempts(setup) as attempts:
        for index in range(32):
            x, physics = draw(setup, int(SEED), index)
            values = setup.controller.values(x)
            is_deadly = bool((values > 0.94).any() or (values < -0.985).any())
            expected.append(FAILED if is_deadly else attempts.rollout(x, physics).f)
    stored = [episode for _, columns in dataset.batches() for episode in map(columns.row, range(16))]
    assert [FAILED if episode.stop == FAILED else episode.f for episode in stored] == expected
    assert [index for index, value in enumerate(expected) if value == FAILED] == [13, 18, 24]
    assert "3 failed, " in done.stderr
    accounts = "".join(
        path.read_text(encoding="utf-8") for path in (folder / "data" / "quarantine").iterdir()
    )
    assert "KeyError: 'puck', at deadly.py:" in accounts
    assert "it ended its process: Fatal Python error: Aborted" in accounts
    assert "it took longer than 3 s" in accounts


@pytest.mark.slow
def test_a_comparison_reports_of_what_there_is_and_names_the_failed_trials(folder):
    grid = ("--methods", "random", "--runs", "2", "--trials", "8")
    done = svaedc(
        folder,
        "compare",
        "--setup",
        "deadly",
        *grid,
        "--out",
        "out",
        *("--set", "compare.episode_timeout_seconds=3", "--set", "compare.pool_size=50"),
    )
    assert done.returncode == 0, done.stderr
    trials = [
        json.loads(line)
        for path in sorted((folder / "out" / "runs").glob("*.jsonl"))
        for line in path.read_text(encoding="utf-8").splitlines()
    ]
    assert len(trials) == 20
    failed = [trial for trial in trials if trial["status"] == "failed"]
    assert failed
    assert {trial["stop"].partition(":")[0] for trial in failed} == {"failed"}
    assert len(list((folder / "out" / "failed").iterdir())) == len(failed)
    assert all((folder / "out" / name).exists() for name in ("report.html", "figure.png", "summary.json"))
    assert "what the first of them failed of is in" in done.stderr
