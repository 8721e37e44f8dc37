"""The training cache against the dataset it was decoded from."""

import json
import shutil
import subprocess
import sys
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from workers.dataset import schema, shards
from workers.dataset.cache import require_space, training_cache
from workers.dataset.folder import Dataset, create
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import writer

SANE = [index for index in range(20) if index % 7 != 3]


@pytest.mark.parametrize("stride", [1, 3, 5, 20])
def test_the_cache_is_the_dataset_at_its_stride(dataset, tmp_path, identity, episodes_of, stride):
    cache = training_cache(dataset, stride, tmp_path / "cache")
    episodes = episodes_of(identity, SANE)
    steps = np.arange(stride - 1, 20 // stride * stride, stride)
    assert cache.episode.tolist() == SANE
    assert np.array_equal(cache.x, np.stack([e.x for e in episodes]))
    assert np.array_equal(cache.xi, np.stack([e.xi for e in episodes])[:, :, steps])
    assert np.array_equal(cache.bad, (np.stack([e.bad for e in episodes])[:, steps] != 0).astype(np.float32))
    assert np.array_equal(cache.y, np.array([e.y for e in episodes], dtype=np.float32))
    assert np.array_equal(cache.f, np.array([e.f for e in episodes], dtype=np.float32))


def test_diverged_episodes_are_left_out(dataset, tmp_path):
    cache = training_cache(dataset, 5, tmp_path)
    assert sum(map(dataset.sane_episodes, dataset.shards())) == len(cache.episode) == 17
    assert not set(cache.episode.tolist()) & {3, 10, 17}


def test_stopped_episodes_may_be_learnt_from_and_diverged_ones_may_not(guarded, tmp_path):
    cache = training_cache(guarded, 5, tmp_path)
    assert cache.episode.tolist() == [index for index in range(16) if index not in (3, 10)]
    assert sum(map(guarded.sane_episodes, guarded.shards())) == 14
    stopped = np.isin(cache.episode, (1, 6, 11))
    assert np.all(cache.bad[stopped][:, 2:] == 1.0)  # steps 14 and 19 of 20, stopped at 11
    assert np.all(cache.xi[stopped][:, :, 2] == cache.xi[stopped][:, :, 3])
    assert np.all(cache.f[stopped] == -2.0)


def test_the_arrays_are_memory_mapped_and_read_only(dataset, tmp_path):
    cache = training_cache(dataset, 5, tmp_path)
    assert isinstance(cache.xi, np.memmap)
    assert not cache.xi.flags.writeable


def test_held_out_and_training_rows_part_the_cache(dataset, tmp_path):
    cache = training_cache(dataset, 5, tmp_path)
    assert sorted([*cache.held_out(), *cache.training()]) == list(range(17))
    assert cache.episode[cache.held_out()].tolist() == [9, 19]


def test_held_out_episodes_stay_held_out_when_the_dataset_grows(dataset, tmp_path, fill):
    before = training_cache(dataset, 5, tmp_path)
    fill(dataset, 60)
    after = training_cache(dataset, 5, tmp_path)
    held_out = set(before.episode[before.held_out()].tolist())
    assert held_out <= set(after.episode[after.held_out()].tolist())
    assert not held_out & set(after.episode[after.training()].tolist())


def test_a_second_opening_reads_what_the_first_has_built(dataset, tmp_path):
    training_cache(dataset, 5, tmp_path)
    built = {path: path.stat().st_mtime_ns for path in tmp_path.glob("*-stride5/*")}
    training_cache(dataset, 5, tmp_path)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.glob("*-stride5/*")} == built
    assert len(built) == 7


@pytest.mark.parametrize("stride", [0, -1, 21])
def test_a_stride_that_does_not_fit_is_refused(dataset, tmp_path, stride):
    with pytest.raises(ValueError, match=f"between 1 and the horizon 20, got {stride}"):
        training_cache(dataset, stride, tmp_path)


def test_an_empty_dataset_is_refused(tmp_path, identity):
    with pytest.raises(ValueError, match="holds no episodes to train on; collect some first"):
        training_cache(create(tmp_path / "empty", identity), 5, tmp_path)


def test_episodes_that_are_there_twice_are_refused_by_name(dataset, tmp_path, identity, episodes_of):
    rows = episodes_of(identity, range(12, 24))
    shards.commit(dataset.folder, Shard(12, 24), lambda path: schema.write(path, identity, 12, rows))
    with pytest.raises(ValueError, match=r"-000000016.parquet and episodes-000000012-.* overlap"):
        training_cache(dataset, 5, tmp_path)


def test_a_damaged_shard_is_refused_by_name_and_leaves_no_cache(dataset, tmp_path):
    path = dataset.path(Shard(8, 16))
    path.write_bytes(path.read_bytes()[:-50])
    with pytest.raises(ValueError, match=rf"{path.name} is damaged"):
        training_cache(dataset, 5, tmp_path / "cache")
    assert not (tmp_path / "cache").exists() or list((tmp_path / "cache").iterdir()) == []


def test_a_disk_that_is_too_small_is_refused_with_both_sizes(tmp_path):
    with pytest.raises(OSError, match=r"needs 54\.00 GB below .*, only 3\.20 GB are free.*train\.stride"):
        require_space(54 * 10**9, 32 * 10**8, tmp_path)
    assert require_space(10, 10, tmp_path) is None


def test_a_dataset_larger_than_the_disk_is_refused_before_it_is_decoded(tmp_path, dataset, monkeypatch):
    """A small disk cannot be mounted without an administrator; only what it reports is put in its place."""
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=100))
    with pytest.raises(OSError, match="GB are free"):
        training_cache(dataset, 1, tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_what_a_killed_builder_left_behind_is_removed_by_the_next(dataset, tmp_path):
    gone = subprocess.Popen([sys.executable, "-c", "pass"])
    gone.wait()
    host, boot, _ = writer().split(".")
    left = tmp_path / f"0123456789abcdef-stride5.{host}.{boot}.{gone.pid}"
    left.mkdir()
    (left / "xi.npy").write_bytes(b"half")
    training_cache(dataset, 5, tmp_path)
    assert not left.exists()


def test_two_processes_that_build_at_once_end_with_one_cache(dataset, tmp_path):
    script = (
        "import sys; from pathlib import Path\n"
        "from workers.dataset.folder import open_dataset\n"
        "from workers.dataset.cache import training_cache\n"
        "cache = training_cache(open_dataset(Path(sys.argv[1])), 5, Path(sys.argv[2]))\n"
        "print(float(cache.xi.sum()))\n"
    )
    command = [sys.executable, "-c", script, str(dataset.folder), str(tmp_path / "cache")]
    both = [subprocess.Popen(command, stdout=subprocess.PIPE, text=True) for _ in range(2)]
    printed = [process.communicate(timeout=300)[0].splitlines()[-1] for process in both]
    assert [process.returncode for process in both] == [0, 0]
    expected = float(training_cache(dataset, 5, tmp_path / "alone").xi.sum())
    assert printed == [str(expected)] * 2
    assert len(list((tmp_path / "cache").iterdir())) == 1


def test_numbers_that_are_not_finite_are_refused_by_shard_and_episode(tmp_path, identity, episodes_of):
    dataset = create(tmp_path / "dataset", identity)
    rows = episodes_of(identity, range(8))
    rows[5].xi[1, 9] = np.nan
    shards.commit(dataset.folder, Shard(0, 8), lambda path: schema.write(path, identity, 0, rows))
    with pytest.raises(ValueError, match=r"-000000008\.parquet holds NaN or infinity in xi of episode 5"):
        training_cache(dataset, 5, tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_a_shard_of_diverged_episodes_adds_nothing(dataset, tmp_path, identity, episodes_of):
    rows = [replace(row, stop="diverged") for row in episodes_of(identity, range(20, 24))]
    shards.commit(dataset.folder, Shard(20, 24), lambda path: schema.write(path, identity, 20, rows))
    assert training_cache(dataset, 5, tmp_path).episode.tolist() == SANE


def test_shards_that_arrive_while_a_cache_is_built_are_left_to_the_next(dataset, tmp_path, fill):
    class Growing(Dataset):
        """A dataset that another process extends whenever somebody has looked at it."""

        def shards(self):
            found = super().shards()
            fill(dataset, dataset.episodes() + 8)
            return found

    fingerprint = dataset.fingerprint()
    cache = training_cache(Growing(dataset.folder, dataset.identity), 5, tmp_path / "cache")
    assert dataset.episodes() > 20
    assert [path.name for path in (tmp_path / "cache").iterdir()] == [f"{fingerprint[:16]}-stride5"]
    assert cache.episode.tolist() == SANE


@pytest.mark.parametrize("change", [{"stop": "diverged"}, {"f": 7.0}])
def test_a_shard_that_is_replaced_while_a_cache_is_built_is_refused_and_leaves_none(
    dataset, tmp_path, identity, episodes_of, change
):
    class Changing(Dataset):
        """A dataset whose second shard is replaced while the first is read."""

        def read(self, shard):
            rows = episodes_of(identity, range(8, 16))
            rows[4] = replace(rows[4], **change)
            dataset.path(Shard(8, 16)).unlink()
            shards.commit(dataset.folder, Shard(8, 16), lambda path: schema.write(path, identity, 8, rows))
            return super().read(shard)

    with pytest.raises(ValueError, match=r"was changed while it was decoded; let whatever .* run this again"):
        training_cache(Changing(dataset.folder, dataset.identity), 5, tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def _spoilt(path, change) -> None:
    path.write_bytes(change(path.read_bytes()))


@pytest.mark.parametrize("name", ["episode", "x", "xi", "bad", "y", "f"])
def test_a_flipped_bit_anywhere_in_a_cache_is_refused_with_the_folder_to_delete(dataset, tmp_path, name):
    training_cache(dataset, 5, tmp_path)
    (folder,) = tmp_path.glob("*-stride5")
    _spoilt(folder / f"{name}.npy", lambda content: content[:-1] + bytes([content[-1] ^ 1]))
    with pytest.raises(ValueError, match=rf"{folder} is damaged: the bytes of {name}\.npy are not .* delete"):
        training_cache(dataset, 5, tmp_path)
    shutil.rmtree(folder)
    assert training_cache(dataset, 5, tmp_path).episode.tolist() == SANE


@pytest.mark.parametrize("name", ["xi.npy", "cache.json"])
def test_a_truncated_cache_is_refused_with_the_folder_to_delete(dataset, tmp_path, name):
    training_cache(dataset, 5, tmp_path)
    (folder,) = tmp_path.glob("*-stride5")
    _spoilt(folder / name, lambda content: content[: len(content) // 2])
    with pytest.raises(ValueError, match=f"{folder} is damaged: .*; delete that folder"):
        training_cache(dataset, 5, tmp_path)


def test_a_cache_from_before_there_were_checksums_is_held_to_its_shapes(dataset, tmp_path):
    expected = np.array(training_cache(dataset, 5, tmp_path).xi)
    (folder,) = tmp_path.glob("*-stride5")
    (folder / "cache.json").write_text(json.dumps({"episodes": 17, "stride": 5}))
    assert np.array_equal(training_cache(dataset, 5, tmp_path).xi, expected)
    np.save(folder / "xi.npy", expected[:-1])
    with pytest.raises(ValueError, match=r"xi\.npy must hold float32 \(17, 3, 4\), got float32 \(16, 3, 4\)"):
        training_cache(dataset, 5, tmp_path)
