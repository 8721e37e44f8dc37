"""Datasets where the system's encoding is ASCII, as in containers with `LC_ALL=C`."""

import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import create
from workers.dataset.identity import identity_of

ASCII = {**os.environ, "LC_ALL": "C", "PYTHONUTF8": "0"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A dataset in a folder whose name no ASCII holds, of channels whose names it does not hold either."""
    setup = setups.load("quadratic-30d")
    channels = tuple(replace(channel, name=f"{channel.name} ξ") for channel in setup.observation)
    setup = replace(setup, observation=channels)
    dataset = create(
        tmp_path_factory.mktemp("locale") / "Messläufe", identity_of(setup, seed=0, episodes_per_shard=2)
    )
    for shard in dataset.missing(4):
        collect_shard(setup, dataset, shard)
    return dataset.folder


def svaedc(*arguments: str | Path) -> subprocess.CompletedProcess[bytes]:
    command = [str(Path(sys.executable).parent / "svaedc"), "dataset", *map(str, arguments)]
    return subprocess.run(command, env=ASCII, capture_output=True, check=False)


def test_a_whole_dataset_is_whole_in_ascii_too(folder):
    verified = svaedc("verify", folder)
    assert verified.returncode == 0, verified.stderr
    assert verified.stdout.endswith(b"is whole: 4 episodes in 2 shards\n")


def test_it_is_described_and_exported_in_ascii_too(folder, tmp_path):
    described = svaedc("info", folder)
    assert b"4 in 2 shards" in described.stdout, described.stderr
    for form in ("npz", "lerobot"):
        exported = svaedc("export", folder, "--format", form, "--out", tmp_path / f"für {form}")
        assert exported.returncode == 0, exported.stderr
