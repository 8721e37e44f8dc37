"""A broken shard is found, and its recomputed bytes take its place; nothing good is lost."""

import shutil
from dataclasses import replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from cluster.datasets.repair import repair_dataset
from cluster.errors import UserError
from workers import setups
from workers.collection.recompute import draw_shards, find_broken, rederive, repair
from workers.collection.shard import collect_shard, require_same_code, roll_out
from workers.dataset import schema, shards
from workers.dataset.folder import MANIFEST, create, open_dataset
from workers.dataset.identity import identity_of
from workers.dataset.inventory import inventory, sweep_digests
from workers.dataset.replacement import REPLACED, Repair
from workers.dataset.shards import Shard, digest_path, sha256
from workers.dataset.storage.temporary import WRITING, writer
from workers.dataset.verification import verify

FRANKA = setups.load("franka")
MIDDLE = Shard(2, 4)


@pytest.fixture(scope="module")
def pristine(tmp_path_factory):
    """Three shards of 2, 2 and 1 episodes."""
    folder = tmp_path_factory.mktemp("pristine") / "dataset"
    dataset = create(folder, identity_of(FRANKA, seed=3, episodes_per_shard=2))
    for shard in dataset.missing(5):
        collect_shard(FRANKA, dataset, shard)
    return dataset


@pytest.fixture
def dataset(pristine, tmp_path):
    """A copy to be damaged."""
    return open_dataset(shutil.copytree(pristine.folder, tmp_path / "dataset"))


def flip(dataset, shard, place: float = 0.5) -> None:
    content = bytearray(dataset.path(shard).read_bytes())
    content[int(place * len(content))] ^= 1
    dataset.path(shard).write_bytes(content)


def remove(dataset, shard) -> None:
    dataset.path(shard).unlink()


def remove_digest(dataset, shard) -> None:
    digest_path(dataset.folder, shard).unlink()


def garble_digest(dataset, shard) -> None:
    path = digest_path(dataset.folder, shard)
    path.write_text(path.read_text().replace("episodes-", "epizodes-"))


def swap_for_foreign(dataset, shard) -> None:
    other = replace(dataset.identity, seed=9)
    schema.write(dataset.path(shard), other, shard.start, roll_out(FRANKA, dataset, shard))


def to_repair(dataset) -> list[Shard]:
    return [shard for shard, is_broken in find_broken(dataset) if is_broken]


def found(dataset) -> dict[str, str]:
    problems = [*inventory(dataset), *(each for _, several in verify(dataset) for each in several)]
    return {problem.file: problem.what for problem in problems}


def test_recomputing_a_whole_dataset_finds_nothing_and_changes_nothing(dataset):
    before = {path: path.stat().st_mtime_ns for path in dataset.folder.rglob("*")}
    assert [rederive(FRANKA, dataset, shard) for shard in dataset.shards()] == [[], [], []]
    assert found(dataset) == {}
    assert to_repair(dataset) == []
    assert {path: path.stat().st_mtime_ns for path in dataset.folder.rglob("*")} == before


def test_a_wrong_trajectory_with_a_right_digest_is_found_by_recomputing_alone(dataset):
    episodes = roll_out(FRANKA, dataset, MIDDLE)
    episodes[1].xi[3, 100] += 0.25
    remove(dataset, MIDDLE)
    start = MIDDLE.start
    shards.commit(dataset.folder, MIDDLE, lambda path: schema.write(path, dataset.identity, start, episodes))
    assert found(dataset) == {}
    [problem] = rederive(FRANKA, dataset, MIDDLE)
    assert "1 of its 2 episodes differ, the first of them 3; ξ by up to 0.25" in problem.what


def test_the_same_episodes_in_another_encoding_are_told_apart_from_other_episodes(dataset):
    path = dataset.path(MIDDLE)
    table = pq.read_table(path)
    pq.write_table(table, path)
    [problem] = rederive(FRANKA, dataset, MIDDLE)
    assert problem.what == "recomputed here, its episodes are the same; only their encoding differs"


@pytest.mark.parametrize(
    ("damage", "expected"),
    [
        (flip, Repair.REPLACED),
        (swap_for_foreign, Repair.REPLACED),
        (remove, Repair.ADDED),
        (remove_digest, Repair.DIGEST),
        (garble_digest, Repair.DIGEST),
    ],
)
def test_each_kind_of_damage_is_named_and_repaired_to_the_same_bytes(dataset, pristine, damage, expected):
    good = {
        shard: dataset.path(shard).stat().st_ino
        for shard in dataset.shards()
        if shard != MIDDLE or expected is Repair.DIGEST
    }
    damage(dataset, MIDDLE)
    assert list(found(dataset)) == [MIDDLE.name]
    assert to_repair(dataset) == [MIDDLE]
    assert repair(FRANKA, dataset, MIDDLE) is expected
    assert found(dataset) == {}
    assert dataset.fingerprint() == pristine.fingerprint()
    assert sha256(dataset.path(MIDDLE)) == sha256(pristine.path(MIDDLE))
    assert all(dataset.path(shard).stat().st_ino == number for shard, number in good.items())
    assert list((dataset.folder / WRITING).iterdir()) == []


def test_what_is_replaced_is_kept_under_its_name_and_digest(dataset):
    flip(dataset, MIDDLE)
    bad = dataset.path(MIDDLE).read_bytes()
    digest = sha256(dataset.path(MIDDLE))
    repair(FRANKA, dataset, MIDDLE)
    [kept] = (dataset.folder / REPLACED).iterdir()
    assert kept.name == f"{MIDDLE.name}.{digest[:12]}"
    assert kept.read_bytes() == bad


def test_copies_and_strangers_in_the_folder_are_named(dataset):
    shutil.copy(dataset.path(MIDDLE), dataset.folder / "copy.parquet")
    (dataset.folder / "table.parquet").write_bytes(b"another table")
    assert found(dataset) == {
        "copy.parquet": f"no shard has such a name, and its bytes are a copy of {MIDDLE.name}",
        "table.parquet": "no shard has such a name, and its bytes are those of no shard here",
    }


def test_a_changed_manifest_is_named(dataset):
    path = dataset.folder / "dataset.json"
    path.write_text(path.read_text().replace("\n", "\n ", 1))
    assert "dataset.json" in found(dataset)


def test_a_manifest_that_no_shard_belongs_to_is_the_file_that_is_wrong(dataset):
    manifest = dataset.folder / MANIFEST
    kept, content = manifest.read_bytes(), {path.name for path in dataset.folder.iterdir()}
    manifest.write_text(manifest.read_text().replace('"seed": 3', '"seed": 4'))
    changed = open_dataset(dataset.folder)
    [problem] = inventory(changed)
    assert problem.file == MANIFEST
    assert "no shard belongs to it; they differ in seed: 4 and 3. Remove it: `svaedc collect`" in problem.what
    with pytest.raises(UserError, match=r"differ in seed: 4 and 3\. Nothing is repaired"):
        repair_dataset(changed)
    assert {path.name for path in dataset.folder.iterdir()} == content
    manifest.unlink()
    create(dataset.folder, dataset.identity)
    assert manifest.read_bytes() == kept


def test_a_shard_that_the_disk_does_not_read_is_kept_aside_and_recomputed(dataset, pristine):
    dataset.path(MIDDLE).unlink()
    dataset.path(MIDDLE).symlink_to("/proc/self/mem")
    assert [shard for shard, is_broken in find_broken(dataset) if is_broken] == [MIDDLE]
    assert repair(FRANKA, dataset, MIDDLE) is Repair.REPLACED
    assert dataset.path(MIDDLE).read_bytes() == pristine.path(MIDDLE).read_bytes()
    [aside] = (dataset.folder / REPLACED).iterdir()
    assert aside.name == f"{MIDDLE.name}.unreadable"


def test_digests_that_killed_writers_left_over_are_swept_and_those_of_writers_are_not(dataset):
    for shard in (Shard(0, 1), Shard(3, 4), Shard(90, 92)):
        digest_path(dataset.folder, shard).write_text("0")
    (dataset.folder / WRITING / f"{Shard(3, 4).name}.{writer()}").touch()
    names = {problem.file for problem in inventory(dataset)}
    assert names == {f"{Shard(0, 1).name}.sha256", f"{Shard(3, 4).name}.sha256", Shard(90, 92).name}
    assert sweep_digests(dataset) == 1
    assert not digest_path(dataset.folder, Shard(0, 1)).exists()
    assert digest_path(dataset.folder, Shard(3, 4)).exists()
    assert digest_path(dataset.folder, Shard(90, 92)).exists()


def test_drawn_shards_are_distinct_and_at_most_all(dataset):
    rng = np.random.default_rng(0)
    assert draw_shards(dataset, 99, rng) == dataset.shards()
    assert len(set(draw_shards(dataset, 2, rng))) == 2


def test_code_that_would_roll_out_other_episodes_is_refused(dataset):
    old = replace(dataset, identity=replace(dataset.identity, rollout_version=0))
    with pytest.raises(ValueError, match=r"differ in rollout_version: 0 and"):
        require_same_code(FRANKA, old)
