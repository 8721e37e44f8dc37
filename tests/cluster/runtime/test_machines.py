"""Machines that join a running collection, and machines that are torn from it."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.chaos.victims import kill, raylets
from tests.cluster.conftest import MACHINE
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.storage.temporary import WRITING

REPOSITORY = Path(__file__).parents[3]
SLOW = '''
"""quadratic-30d, but an episode takes a tenth of a second."""

import time
from dataclasses import replace
from functools import partial

from workers.environments.point import Point
from workers.setups.quadratic import quadratic_30d


class Slow(Point):
    def step(self, command):
        time.sleep(0.05)
        return super().step(command)


def setup():
    return replace(quadratic_30d(), name="slow", build=partial(Slow, 30))
'''
PATIENCE = 300.0


@pytest.fixture
def folder(tmp_path, monkeypatch):
    (tmp_path / "slow.py").write_text(SLOW)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{REPOSITORY}")
    return tmp_path


def collecting(folder: Path, address: str, *options: str) -> subprocess.Popen[bytes]:
    """A collection on all CPUs of a cluster, in which a single failed attempt gives a shard up."""
    command = [sys.executable, "-m", "cluster", "collect", "--setup", "slow", "--dataset", "data"]
    command += ["--episodes", "1600", *options, *(["--address", address] if address else [])]
    settings = {"tracking.uri": "sqlite:///mlflow.db", "collect.episodes_per_shard": 4}
    settings |= {"collect.attempts_per_shard": 1, "collect.actors": "all"}
    command += [word for name, value in settings.items() for word in ("--set", f"{name}={value}")]
    with (folder / "log").open("wb") as log:
        return subprocess.Popen(command, cwd=folder, stdout=log, stderr=log, env=dict(os.environ))


def wait_for(text: str, folder: Path, driver: subprocess.Popen[bytes]) -> None:
    deadline = time.monotonic() + PATIENCE
    while text not in (said := (folder / "log").read_text()):
        assert driver.poll() is None, said
        assert time.monotonic() < deadline, said
        time.sleep(0.1)


@pytest.mark.slow
def test_a_collection_whose_ray_is_killed_says_so_and_the_same_command_goes_on(folder):
    driver = collecting(folder, "", "--set", "ray.num_cpus=1")
    wait_for("/1600 episodes", folder, driver)
    (raylet,) = raylets(driver.pid)
    assert kill(raylet)
    assert driver.wait(PATIENCE) == 1
    said = (folder / "log").read_text()
    assert "error: Ray has ended on this machine" in said
    assert "Traceback" not in said
    before = len(open_dataset(folder / "data").shards())
    again = collecting(folder, "", "--set", "ray.num_cpus=1")
    wait_for("/1600 episodes", folder, again)
    assert len(open_dataset(folder / "data").shards()) > before > 0
    again.send_signal(signal.SIGINT)
    again.wait(PATIENCE)


@pytest.mark.slow
def test_a_collection_grows_with_the_cluster_and_no_shard_pays_for_a_machine_that_leaves(folder, machines):
    """The head has no CPUs; the work begins on one machine, a second joins, and the first is torn away."""
    first = machines.add_node(num_cpus=1, **MACHINE)
    driver = collecting(folder, machines.address)
    wait_for("/1600 episodes", folder, driver)
    machines.add_node(num_cpus=2, **MACHINE)
    wait_for("2 more CPUs are free: 3 worker processes from now on", folder, driver)
    machines.remove_node(first, allow_graceful=False)
    wait_for("a machine has left the cluster", folder, driver)
    said = (folder / "log").read_text()
    assert driver.wait(PATIENCE) == 0, said
    assert ", 1 retries" in (folder / "log").read_text()
    dataset = open_dataset(folder / "data")
    assert list((dataset.folder / WRITING).iterdir()) == []
    setup = setups.load("slow")
    alone = create(folder / "alone", identity_of(setup, seed=0, episodes_per_shard=4))
    for shard in alone.missing(40):
        collect_shard(setup, alone, shard)
        assert dataset.path(shard).read_bytes() == alone.path(shard).read_bytes()
    assert dataset.missing(1600) == []
