"""`svaedc dataset`: what a person sees of damage, repair and export."""

import json
import shutil
import subprocess
import sys

import numpy as np
import pytest
from typer.testing import CliRunner

from cluster.cli.main import app
from cluster.errors import UsageError, UserError
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import writer


@pytest.fixture(scope="module")
def pristine(tmp_path_factory):
    """Two shards of two episodes."""
    setup = setups.load("franka")
    folder = tmp_path_factory.mktemp("pristine") / "dataset"
    dataset = create(folder, identity_of(setup, seed=0, episodes_per_shard=2))
    for shard in dataset.missing(4):
        collect_shard(setup, dataset, shard)
    return dataset


@pytest.fixture
def dataset(pristine, tmp_path):
    """A copy to be damaged."""
    return open_dataset(shutil.copytree(pristine.folder, tmp_path / "dataset"))


def run(*arguments: str) -> str:
    """What a command prints to its output; its errors are raised as they are."""
    return CliRunner().invoke(app, ["dataset", *arguments], catch_exceptions=False).output


def test_a_whole_dataset_is_recomputed_in_part_and_said_to_be_whole(dataset):
    said = run("verify", str(dataset.folder), "--rederive", "1")
    assert said.count("episodes-00000000") == 1
    assert said.endswith(f"{dataset.folder} is whole: 4 episodes in 2 shards\n")


def test_damage_is_named_then_repaired_then_gone(dataset, pristine):
    first, second = dataset.shards()
    dataset.path(first).write_bytes(b"damaged")
    dataset.path(second).unlink()
    with pytest.raises(UserError, match=r"3 problems in .* `svaedc dataset repair .*` recomputes"):
        run("verify", str(dataset.folder))
    said = run("repair", str(dataset.folder))
    assert f"{first.name} has been replaced; what was there is kept in .replaced" in said
    assert f"{second.name} was missing and has been added" in said
    assert "is whole: 4 episodes" in run("verify", str(dataset.folder))
    assert dataset.fingerprint() == pristine.fingerprint()
    assert "nothing to repair" in run("repair", str(dataset.folder))


def test_what_repair_cannot_judge_is_left_and_named(dataset):
    copy = dataset.folder / "copy of a shard.parquet"
    shutil.copy(dataset.path(Shard(0, 2)), copy)
    with pytest.raises(UserError, match=r"1 problem in .*, none of broken files"):
        run("repair", str(dataset.folder))
    assert copy.exists()


@pytest.mark.parametrize(("form", "files"), [("npz", "*.npz"), ("lerobot", "data/chunk-000/file-*.parquet")])
def test_an_export_appears_whole_under_its_name_and_never_over_another(dataset, tmp_path, form, files):
    out = tmp_path / "exports" / form
    assert f"{out} holds 4 episodes" in run(
        "export", str(dataset.folder), "--format", form, "--out", str(out)
    )
    assert len(list(out.glob(files))) == 2
    assert list(out.parent.iterdir()) == [out]
    with pytest.raises(UserError, match="exists already"):
        run("export", str(dataset.folder), "--format", form, "--out", str(out))


def test_an_export_of_a_damaged_dataset_leaves_nothing(dataset, tmp_path):
    dataset.path(Shard(2, 4)).write_bytes(b"damaged")
    out = tmp_path / "exports" / "npz"
    with pytest.raises(UserError, match="lists everything that is wrong"):
        run("export", str(dataset.folder), "--format", "npz", "--out", str(out))
    assert list(out.parent.iterdir()) == []


def test_an_export_removes_what_a_killed_one_left_and_nothing_else(dataset, tmp_path):
    script = "import sys; from workers.dataset.storage.temporary import writer; print(writer())"
    dead = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    others = ["npz.backup", f"lerobot.{dead.stdout.strip()}", f"npz.{writer()}-2"]
    for name in (f"npz.{dead.stdout.strip()}", *others):
        (tmp_path / "exports" / name).mkdir(parents=True)
    out = tmp_path / "exports" / "npz"
    run("export", str(dataset.folder), "--format", "npz", "--out", str(out))
    assert {path.name for path in out.parent.iterdir()} == {"npz", *others}


def test_an_unknown_format_is_refused_with_the_nearest(dataset, tmp_path):
    with pytest.raises(UsageError, match="did you mean 'npz'"):
        run("export", str(dataset.folder), "--format", "npy", "--out", str(tmp_path / "out"))


def test_exported_physics_and_frames_are_those_of_the_identity(dataset, tmp_path):
    run("export", str(dataset.folder), "--format", "npz", "--out", str(tmp_path / "npz"))
    run("export", str(dataset.folder), "--format", "lerobot", "--out", str(tmp_path / "lerobot"))
    with np.load(tmp_path / "npz" / "episodes-000000000-000000002.npz") as opened:
        archive = dict(opened)
    assert archive["xi"].shape == (2, 25, 500)
    assert archive["physics_names"].tolist() == sorted(dataset.identity.physics)
    info = json.loads((tmp_path / "lerobot" / "meta" / "info.json").read_text())
    assert info["total_frames"] == 4 * 500
    assert info["features"]["observation.state"]["names"] == archive["observation_names"].tolist()
