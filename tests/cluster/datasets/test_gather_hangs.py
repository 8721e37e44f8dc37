"""Rollouts that never return, whatever they hang in: killed after the time limit, and tried again."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import WRITING

STICKY = '''
"""quadratic-30d, but some episodes hang: once, or for as long as a file says so."""

import ctypes, os, signal, time
from dataclasses import replace
from functools import partial
from pathlib import Path

from workers.environments.point import Point
from workers.setups.quadratic import quadratic_30d
from workers.randomness import Stream, generator

HERE = Path(__file__).parent


def asleep():
    time.sleep(3600)


def in_c():
    signal.pthread_sigmask(signal.SIG_BLOCK, range(1, 32))
    while True:
        ctypes.PyDLL(None).sleep(3600)  # which holds the interpreter's lock, as a loop in C does


def stopped():
    os.kill(os.getpid(), signal.SIGSTOP)


WAYS = {2: asleep, 6: in_c, 10: stopped, 14: in_c}
BY_X = {float(generator(5, Stream.CONTROLLER, index).random(30, "float32")[0]): index for index in WAYS}


class Sticky(Point):
    def step(self, command):
        index = BY_X.get(float(command[0]))
        if index is not None and (HERE / f"hangs-{index}").exists():
            if index != 14:
                (HERE / f"hangs-{index}").unlink()
            WAYS[index]()
        return super().step(command)


def setup():
    return replace(quadratic_30d(), name="sticky", build=partial(Sticky, 30))
'''

LIMIT = 12
"""Seconds for a shard that takes milliseconds: a busy machine must not look like one that hangs."""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A user's folder with the module, in which four episodes are about to hang."""
    (tmp_path / "sticky.py").write_text(STICKY)
    for index in (2, 6, 10, 14):
        (tmp_path / f"hangs-{index}").touch()
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def collected(folder) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "cluster", "collect", "--setup", "sticky", "--dataset", "data"]
    command += ["--episodes", "24", "--seed", "5"]
    settings = {"tracking.uri": "sqlite:///mlflow.db", "ray.num_cpus": 2, "collect.episodes_per_shard": 4}
    settings |= {"collect.shard_timeout_seconds": LIMIT, "collect.attempts_per_shard": 2}
    command += [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[3])}
    return subprocess.run(
        command, capture_output=True, text=True, check=False, cwd=folder, env=environment, timeout=580
    )


@pytest.mark.slow
def test_rollouts_that_hang_are_killed_and_tried_again_and_stall_nothing(folder):
    """One sleeps, one is in C with the interpreter's lock and all signals blocked, one is stopped: each once.

    One hangs at every attempt, until what it hangs in is gone.
    """
    first = collected(folder)
    assert first.returncode == 1
    tried = [f"{Shard(start, start + 4).name} failed and is tried again" for start in (0, 4, 8, 12)]
    assert all(f"{text}: took longer than {LIMIT} s" in first.stderr for text in tried), first.stderr
    assert f"1 shard kept failing, {Shard(12, 16).name} among them" in first.stderr
    dataset = open_dataset(folder / "data")
    assert dataset.missing(24) == [Shard(12, 16)]
    kept = json.loads((folder / "data" / "quarantine" / f"{Shard(12, 16).name}.json").read_text())
    assert kept["errors"] == [f"took longer than {LIMIT} s"] * 2
    assert list((folder / "data" / WRITING).iterdir()) == []

    (folder / "hangs-14").unlink()
    second = collected(folder)
    assert second.returncode == 0, second.stderr
    setup = setups.load("sticky")
    alone = create(folder / "alone", identity_of(setup, seed=5, episodes_per_shard=4))
    for shard in alone.missing(24):
        collect_shard(setup, alone, shard)
    assert dataset.fingerprint() == alone.fingerprint()
    assert list((folder / "data" / "quarantine").iterdir()) == []
