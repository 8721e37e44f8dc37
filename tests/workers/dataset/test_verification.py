"""Whatever is wrong with a dataset, verification names the file and what."""

from dataclasses import replace

import numpy as np
import pytest

from workers.dataset import schema, shards
from workers.dataset.folder import Dataset
from workers.dataset.inventory import inventory
from workers.dataset.shards import Shard
from workers.dataset.verification import gaps, verify

MIDDLE = Shard(8, 16)


def _problems(dataset: Dataset) -> dict[str, str]:
    return {
        problem.file: " | ".join(each.what for each in found)
        for _, found in verify(dataset)
        for problem in found
    }


def _rewrite(dataset, shard, identity, episodes) -> None:
    """Replace a shard, its digest included, as a careless copy would."""
    dataset.path(shard).unlink(missing_ok=True)
    start = shard.start
    shards.commit(dataset.folder, shard, lambda path: schema.write(path, identity, start, episodes))


def test_a_whole_dataset_has_no_problems(dataset):
    assert _problems(dataset) == {}
    assert [shard for shard, _ in verify(dataset)] == [Shard(0, 8), MIDDLE, Shard(16, 20)]


def test_verification_changes_nothing(dataset):
    before = {path: path.stat().st_mtime_ns for path in dataset.folder.rglob("*")}
    dataset.path(MIDDLE).write_bytes(b"damaged")
    list(verify(dataset))
    after = {path: path.stat().st_mtime_ns for path in dataset.folder.rglob("*")}
    assert before.keys() == after.keys()


def test_a_truncated_shard_is_named(dataset):
    path = dataset.path(MIDDLE)
    path.write_bytes(path.read_bytes()[:-100])
    found = _problems(dataset)
    assert list(found) == [MIDDLE.name]
    assert "its bytes differ from its .sha256 file" in found[MIDDLE.name]
    assert "damaged" in found[MIDDLE.name]


@pytest.mark.parametrize("place", [0.02, 0.3, 0.6, 0.99])
def test_a_flipped_byte_is_named(dataset, place):
    path = dataset.path(MIDDLE)
    content = bytearray(path.read_bytes())
    content[int(place * len(content))] ^= 0x10
    path.write_bytes(content)
    assert "its bytes differ from its .sha256 file" in _problems(dataset)[MIDDLE.name]


def test_a_missing_digest_is_named(dataset):
    shards.digest_path(dataset.folder, MIDDLE).unlink()
    assert _problems(dataset) == {MIDDLE.name: "its .sha256 file is missing"}


def test_a_shard_that_the_disk_does_not_read_is_named_and_the_others_are_checked(dataset):
    first, *others = dataset.shards()
    dataset.path(first).unlink()
    dataset.path(first).symlink_to("/proc/self/mem")  # whose first page gives EIO, as a bad sector does
    found = {shard: [problem.what for problem in problems] for shard, problems in verify(dataset)}
    unread, not_parquet = found.pop(first)
    assert unread == "the disk does not read it"
    assert "is damaged or no Parquet file" in not_parquet
    assert found == {shard: [] for shard in others}


def test_a_file_whose_name_counts_backwards_is_no_shard(dataset):
    (dataset.folder / "episodes-000000512-000000512.parquet").write_bytes(b"stray")
    assert all(not problems for _, problems in verify(dataset))
    assert [problem.what for problem in inventory(dataset)] == [
        "no shard has such a name, and its bytes are those of no shard here"
    ]


def test_a_gap_is_nobodys_fault(dataset):
    assert list(gaps(dataset)) == []
    dataset.path(MIDDLE).unlink()
    assert list(gaps(dataset)) == [MIDDLE]
    assert _problems(dataset) == {}


def test_gaps_and_shards_together_are_every_episode_once(dataset, fill):
    for shard in (Shard(0, 8), MIDDLE):
        dataset.path(shard).unlink()
    assert list(gaps(dataset)) == [Shard(0, 16)]
    fill(dataset, 40)
    for shard in (MIDDLE, Shard(20, 24), Shard(24, 32)):
        dataset.path(shard).unlink()
    assert list(gaps(dataset)) == [MIDDLE, Shard(20, 32)]


def test_an_overlap_is_named(dataset, identity, episodes_of):
    overlapping = Shard(12, 24)
    _rewrite(dataset, overlapping, identity, episodes_of(identity, range(12, 24)))
    found = _problems(dataset)
    assert "it overlaps: episodes below 16" in found[overlapping.name]
    assert set(found) == {overlapping.name, Shard(16, 20).name}


def test_a_shard_of_another_dataset_is_named_with_the_field_that_differs(dataset, identity, episodes_of):
    other = replace(identity, horizon=30)
    _rewrite(dataset, MIDDLE, other, episodes_of(other, range(8, 16)))
    assert "it belongs to another dataset: horizon: 20 and 30" in _problems(dataset)[MIDDLE.name]


def test_a_shard_of_another_seed_is_named(dataset, identity, episodes_of):
    other = replace(identity, seed=6)
    _rewrite(dataset, MIDDLE, other, episodes_of(other, range(8, 16)))
    assert "seed: 5 and 6" in _problems(dataset)[MIDDLE.name]


def test_controllers_and_physics_that_do_not_follow_from_the_seed_are_named(dataset, identity, episodes_of):
    other = replace(identity, seed=6)
    _rewrite(dataset, MIDDLE, identity, episodes_of(other, range(8, 16)))
    found = _problems(dataset)[MIDDLE.name]
    assert "its controllers are not those of seed 5" in found
    assert "its physics are not those of seed 5" in found


def test_a_shard_renamed_to_other_episodes_is_named(dataset, identity, episodes_of):
    _rewrite(dataset, Shard(20, 24), identity, episodes_of(identity, range(20, 24)))
    dataset.path(Shard(20, 24)).rename(dataset.path(Shard(24, 28)))
    found = _problems(dataset)[Shard(24, 28).name]
    assert "its rows are not the episodes 24 to 27" in found
    assert list(gaps(dataset)) == [Shard(20, 24)]


def test_badness_that_is_not_the_mean_of_the_bad_steps_is_named(dataset, identity, episodes_of):
    episodes = episodes_of(identity, range(8, 16))
    episodes[3] = replace(episodes[3], y=episodes[3].y / 2)
    _rewrite(dataset, MIDDLE, identity, episodes)
    assert _problems(dataset) == {MIDDLE.name: "y is not the mean of the bad steps"}


def test_a_whole_dataset_with_stopped_episodes_has_no_problems(guarded):
    assert _problems(guarded) == {}


@pytest.mark.parametrize(
    ("index", "spoil", "what"),
    [
        (9, {"stop": "too far"}, "its stop reasons do not fit the condition 'stopped' of the last steps"),
        (11, {"stop": ""}, "its stop reasons do not fit the condition 'stopped' of the last steps"),
        (
            10,
            {"bad": np.array([0] + [7] * 19, dtype=np.uint8), "y": 0.95},
            "diverged or failed episode has steps that are not",
        ),
        (11, {"bad": np.array([4, 1] + [4] * 18, dtype=np.uint8), "y": 1.0}, "goes on after it was stopped"),
    ],
)
def test_a_stop_that_does_not_fit_its_steps_is_named(guarded, stopped_of, index, spoil, what):
    episodes = stopped_of(guarded.identity, range(8, 16))
    episodes[2] = replace(episodes[2], bad=episodes[2].bad | 4)  # the diverged one
    episodes[index - 8] = replace(episodes[index - 8], **spoil)
    _rewrite(guarded, MIDDLE, guarded.identity, episodes)
    found = _problems(guarded)
    assert list(found) == [MIDDLE.name]
    assert what in found[MIDDLE.name]
    assert " | " not in found[MIDDLE.name]


def test_a_stopped_episode_of_a_setup_without_a_stop_rule_is_named(dataset, identity, stopped_of):
    _rewrite(dataset, MIDDLE, identity, stopped_of(identity, range(8, 16)))
    assert _problems(dataset) == {
        MIDDLE.name: "its stop reasons do not fit the condition 'stopped' of the last steps"
    }


def test_numbers_that_are_not_finite_are_named(dataset, identity, episodes_of):
    episodes = episodes_of(identity, range(8, 16))
    episodes[3].xi[1, 4] = np.nan
    _rewrite(dataset, MIDDLE, identity, episodes)
    assert _problems(dataset) == {MIDDLE.name: "it holds numbers that are not finite"}
