"""Collecting real shards: the same bytes whoever collects them, however often, and whatever dies."""

import signal
import subprocess
import sys
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset import shards
from workers.dataset.folder import Dataset, create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.verification import verify
from workers.environments.tabletop import Tabletop
from workers.rollout import random_episode
from workers.setups.franka import MODEL

COLLECT = """
import os, resource, signal, sys
from pathlib import Path
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import open_dataset

dataset, largest_file, last = open_dataset(Path(sys.argv[1])), int(sys.argv[2]), sys.argv[3]

def die(event, arguments):
    if event == "os.link" and last in str(arguments[1]):
        os.kill(os.getpid(), signal.SIGKILL)

sys.addaudithook(die)
resource.setrlimit(resource.RLIMIT_FSIZE, (largest_file, largest_file))
setup = setups.load("franka")
for shard in dataset.missing(12):
    collect_shard(setup, dataset, shard)
"""
UNLIMITED = 1 << 40


class _Exploding(Tabletop):
    """The Franka scene, whose arm is flung away in the third episode."""

    def __init__(self, model):
        super().__init__(model)
        self.episodes = 0

    def reset(self, physics):
        super().reset(physics)
        self.episodes += 1

    def step(self, command):
        return super().step([float("nan")] * len(command) if self.episodes == 3 else command)


def _new(folder: Path) -> Dataset:
    return create(folder, identity_of(setups.load("franka"), seed=3, episodes_per_shard=4))


def _start(dataset: Dataset, *, largest_file: int = UNLIMITED, dies_at: str = "never") -> subprocess.Popen:
    """Collects in a process of its own; `dies_at` is the name of the file it is killed before publishing."""
    command = [sys.executable, "-c", COLLECT, str(dataset.folder), str(largest_file), dies_at]
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)


def _files(dataset: Dataset) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in dataset.folder.iterdir() if path.is_file()}


@pytest.fixture(scope="module")
def whole(tmp_path_factory) -> Dataset:
    setup = setups.load("franka")
    dataset = _new(tmp_path_factory.mktemp("whole") / "dataset")
    for shard in reversed(dataset.missing(12)):
        collect_shard(setup, dataset, shard)
    return dataset


def test_a_collected_dataset_is_whole(whole):
    assert [found for _, found in verify(whole)] == [[], [], []]
    assert whole.episodes() == 12
    assert whole.missing(12) == []


def test_a_shard_holds_the_episodes_of_its_indices(whole):
    setup = setups.load("franka")
    columns = whole.read(Shard(4, 8))
    with setup.open() as environment:
        for row in (2, 0):
            episode = random_episode(setup, environment, 3, 4 + row)
            assert columns.xi[row].tobytes() == episode.xi.tobytes()
            assert columns.f[row] == np.float32(episode.f)


def test_a_franka_trajectory_takes_less_than_28_kb(whole):
    assert whole.size() / whole.episodes() < 28_000


def test_the_report_sums_up_the_shard(tmp_path):
    dataset = _new(tmp_path / "dataset")
    report = collect_shard(setups.load("franka"), dataset, Shard(0, 3))
    columns = dataset.read(Shard(0, 3))
    assert report.shard == Shard(0, 3)
    assert report.badness == pytest.approx(columns.y.mean(), abs=1e-6)
    assert report.best == columns.f.max()
    assert (report.diverged, report.stopped) == (0, 0)
    assert report.size == dataset.path(Shard(0, 3)).stat().st_size
    assert report.rollout_seconds > report.storage_seconds >= 0.0


def test_the_report_tells_stopped_episodes_from_diverged_ones(tmp_path):
    """Of a setup that stops every episode in its first step; the third has exploded by then."""
    setup = replace(
        setups.load("franka"), build=partial(_Exploding, MODEL), stop=lambda _: "at once", horizon=9
    )
    dataset = create(tmp_path / "dataset", identity_of(setup, seed=3, episodes_per_shard=4))
    report = collect_shard(setup, dataset, Shard(0, 4))
    assert dataset.read(Shard(0, 4)).stop == ("at once", "at once", "diverged", "at once")
    assert (report.diverged, report.stopped) == (1, 3)
    assert dataset.sane_episodes(Shard(0, 4)) == 3
    assert [found for _, found in verify(dataset)] == [[]]


def test_two_processes_collecting_the_same_shards_write_what_one_writes(tmp_path, whole):
    dataset = _new(tmp_path / "dataset")
    both = [_start(dataset), _start(dataset)]
    errors = [process.communicate(timeout=300)[1] for process in both]
    assert [process.returncode for process in both] == [0, 0], errors
    assert _files(dataset) == _files(whole)
    assert list((dataset.folder / ".writing").iterdir()) == []


def test_a_collection_killed_midway_is_completed_to_the_same_bytes(tmp_path, whole):
    dataset = _new(tmp_path / "dataset")
    killed = _start(dataset, dies_at=Shard(4, 8).name)
    killed.communicate(timeout=300)
    assert killed.returncode == -signal.SIGKILL
    assert dataset.shards() == [Shard(0, 4)]
    shards.sweep(dataset.folder)
    for shard in dataset.missing(12):
        collect_shard(setups.load("franka"), dataset, shard)
    assert _files(dataset) == _files(whole)
    assert list((dataset.folder / ".writing").iterdir()) == []


def test_a_file_that_may_not_grow_is_an_os_error_and_publishes_nothing(tmp_path):
    dataset = _new(tmp_path / "dataset")
    failed = _start(dataset, largest_file=50_000)
    _, error = failed.communicate(timeout=300)
    assert failed.returncode == 1
    assert "OSError: [Errno 27]" in error
    assert dataset.shards() == []
    assert sorted(path.name for path in dataset.folder.iterdir()) == [".writing", "dataset.json"]
    assert list((dataset.folder / ".writing").iterdir()) == []
