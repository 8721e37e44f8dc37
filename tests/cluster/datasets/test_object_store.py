"""`svaedc` on an object store: the commands, and a collection that is killed."""

import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from cluster.cli.main import app
from cluster.config import CollectSettings
from cluster.datasets.pilot import add_cost
from cluster.datasets.plan import plan_collection
from cluster.datasets.progress import CollectionProgress
from cluster.datasets.quarantine import put_aside, quarantined_shards, release
from cluster.datasets.worker import RolloutActor
from cluster.errors import UserError
from cluster.inputs import dataset_location
from svaedc.model import checkpoint
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import Dataset, create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.storage.location import Location
from workers.dataset.storage.temporary import WRITING

SETUP = "quadratic-30d"


@pytest.fixture
def place(object_store, bucket, monkeypatch) -> str:
    """An address in the store that the environment names, here and for commands."""
    monkeypatch.setenv("AWS_ENDPOINT_URL", f"http://{object_store}")
    return f"s3://{bucket}/data"


@pytest.fixture
def remote(place) -> Dataset:
    """Two shards of four episodes, collected by a rollout process."""
    dataset = begun(dataset_location(place), 4)
    worker = RolloutActor(SETUP, str(dataset.folder), 60.0)
    for shard in dataset.missing(8):
        worker.collect(shard)
    return dataset


def begun(folder: Location, per_shard: int, setup: str = SETUP) -> Dataset:
    return create(folder, identity_of(setups.load(setup), seed=3, episodes_per_shard=per_shard))


def alone(folder: Path, episodes: int, per_shard: int, setup: str = SETUP) -> Dataset:
    """The same dataset on a disk, made in this process."""
    dataset = begun(folder, per_shard, setup)
    for shard in dataset.missing(episodes):
        collect_shard(setups.load(setup), dataset, shard)
    return dataset


def content(folder: Location) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.name != WRITING}


def run(*arguments: str) -> str:
    """What a command prints to its output; its errors are raised as they are."""
    return CliRunner().invoke(app, ["dataset", *arguments], catch_exceptions=False).output


def test_a_rollout_process_writes_to_the_store_what_one_writes_to_a_disk(remote, tmp_path):
    assert content(remote.folder) == content(alone(tmp_path, 8, 4).folder)


def test_commands_look_into_it_damage_is_named_then_repaired_then_gone(remote, place, tmp_path):
    assert "8 in 2 shards" in run("info", place)
    run("export", place, "--format", "npz", "--out", str(tmp_path / "npz"))
    assert len(list((tmp_path / "npz").glob("*.npz"))) == 2
    before, (first, second) = content(remote.folder), remote.shards()
    remote.path(first).write_bytes(b"damaged")
    remote.path(second).unlink()
    with pytest.raises(UserError, match=r"3 problems in s3://.*; `svaedc dataset repair s3://.*` recomputes"):
        run("verify", place)
    said = run("repair", place)
    assert f"{first.name} has been replaced" in said
    assert f"{second.name} was missing and has been added" in said
    assert "is whole: 8 episodes in 2 shards" in run("verify", place, "--rederive", "1")
    assert content(remote.folder) == before


def test_errors_of_shards_and_the_account_of_a_plan_are_kept_in_it(remote):
    missing = replace(remote.shards()[0], start=8, stop=12)
    path = put_aside(remote, missing, ["it failed"])
    assert "it failed" in path.read_text()
    assert quarantined_shards(remote, 12) == [missing]
    RolloutActor(SETUP, str(remote.folder), 60.0).collect(missing)
    release(remote)
    assert quarantined_shards(remote) == []
    add_cost(remote, CollectionProgress(episodes=4), 1.0)
    assert open_dataset(remote.folder).episodes() == 12


@pytest.mark.parametrize("where", ["away", "nowhere"])
def test_a_store_that_cannot_be_used_is_told_with_the_remedy(where, free_port, remote):
    wrong = {
        "away": (f"s3://bucket/data?endpoint_override=127.0.0.1:{free_port}&scheme=http", "does not answer"),
        "nowhere": ("s3://nobody-s/data", "no bucket for s3://nobody-s.*: create it"),
    }
    address, message = wrong[where]
    with pytest.raises(UserError, match=message):
        plan_collection(
            setup=setups.load(SETUP),
            episodes=8,
            folder=dataset_location(address),
            seed=remote.identity.seed,
            settings=CollectSettings(episodes_per_shard=remote.identity.episodes_per_shard),
        )


def command(*arguments: str, root: Path) -> list[str]:
    store = ("--set", f"tracking.uri=sqlite:///{root / 'mlflow.db'}", "--set", "ray.num_cpus=2")
    return [sys.executable, "-m", "cluster", *arguments, *store]


@pytest.mark.slow
def test_a_collection_into_a_store_that_is_killed_goes_on_to_the_bytes_of_a_disk_and_trains(place, tmp_path):
    collect = command(
        *("collect", "--setup", "franka", "--dataset", place, "--episodes", "240", "--seed", "3"),
        *("--set", "collect.episodes_per_shard=8", "--set", "collect.actors=2"),
        root=tmp_path,
    )
    with subprocess.Popen(collect) as first:
        deadline = time.monotonic() + 600
        folder = dataset_location(place)
        while len(list(folder.glob("*.parquet"))) < 3:
            assert first.poll() is None
            assert time.monotonic() < deadline
            time.sleep(0.1)
        first.kill()
    assert open_dataset(folder).episodes() < 240
    subprocess.run(collect, check=True)
    dataset = open_dataset(folder)
    assert content(folder) == content(alone(tmp_path / "alone", 240, 8, "franka").folder)
    assert list((folder / WRITING).iterdir()) == []
    verify = [sys.executable, "-m", "cluster", "dataset", "verify", place]
    said = subprocess.run(verify, check=True, capture_output=True, text=True).stdout
    assert "is whole: 240 episodes in 30 shards" in said
    train = command(
        *("train", "--dataset", place, "--model", str(tmp_path / "model"), "--preset", "compact"),
        *("--set", "train.updates=10", "--set", "train.threads=1"),
        *("--set", f"train.cache_folder={tmp_path / 'cache'}"),
        root=tmp_path,
    )
    subprocess.run(train, check=True)
    _, metadata = checkpoint.load(tmp_path / "model" / "model.pt")
    assert metadata["dataset"] == dataset.fingerprint()
    [cache] = (tmp_path / "cache").iterdir()
    assert len(np.load(cache / "episode.npy")) == 240
