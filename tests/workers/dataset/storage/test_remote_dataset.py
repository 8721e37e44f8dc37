"""A dataset in an object store: the bytes, the promises and the refusals of one on a disk."""

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.workers.dataset.storage.contents import FIRST, LAST, content, problems
from workers.dataset import shards
from workers.dataset.cache import training_cache
from workers.dataset.exports.npz import export_npz
from workers.dataset.folder import MANIFEST, create, open_dataset
from workers.dataset.identity import Identity
from workers.dataset.manifest import manifest_text
from workers.dataset.statistics import statistics
from workers.dataset.storage.location import Location, location
from workers.dataset.storage.temporary import WRITING, writer


def test_a_store_holds_the_bytes_of_the_same_dataset_on_a_disk(remote, dataset):
    assert content(remote.folder) == content(dataset.folder)
    assert list((remote.folder / WRITING).iterdir()) == []
    assert remote.fingerprint() == dataset.fingerprint()
    assert remote.size() == dataset.size()
    assert problems(remote) == {}


def test_whoever_reads_it_sees_the_episodes_of_the_disk(remote, dataset, address, tmp_path):
    opened = open_dataset(location(address))
    assert opened == remote
    assert np.array_equal(opened.episode(17).xi, dataset.episode(17).xi)
    assert list(map(opened.sane_episodes, opened.shards())) == [7, 7, 3]
    assert statistics(opened).badness == statistics(dataset).badness
    for name, source in (("remote", opened), ("local", dataset)):
        (tmp_path / name).mkdir()
        list(export_npz(source, tmp_path / name))
    assert content(tmp_path / "remote") == content(tmp_path / "local")


def test_training_reads_the_same_cache_from_either(remote, dataset, tmp_path):
    caches = [training_cache(each, 5, tmp_path / name) for name, each in (("s", remote), ("d", dataset))]
    for name in ("episode", "x", "xi", "bad", "y", "f"):
        assert np.array_equal(*(getattr(cache, name) for cache in caches))
    built, expected = ([path.name for path in (tmp_path / name).iterdir()] for name in "sd")
    assert built == expected


def test_a_lost_shard_and_an_extension_are_all_that_is_written(remote, dataset, fill):
    remote.path(FIRST).write_bytes(b"whoever writes this again shows it")
    remote.path(LAST).unlink()
    assert remote.missing(20) == [LAST]
    fill(remote, 20)
    for each in (remote, dataset):
        fill(each, 30)
    written, expected = content(remote.folder), content(dataset.folder)
    assert written.pop(FIRST.name) == b"whoever writes this again shows it"
    assert expected.pop(FIRST.name)
    assert written == expected


def test_another_specification_is_refused_naming_the_field(remote, identity):
    before = content(remote.folder)
    with pytest.raises(ValueError, match="differ in seed: 5 and 6"):
        create(remote.folder, replace(identity, seed=6))
    assert content(remote.folder) == before


def test_two_writers_of_one_dataset_lose_and_double_nothing(place, identity, fill, dataset):
    with ThreadPoolExecutor(2) as writers:
        list(writers.map(lambda _: fill(create(place, identity), 20), range(2)))
    assert content(place) == content(dataset.folder)


def test_of_two_that_begin_different_datasets_at_once_never_both_go_on(place, identity):
    barrier = threading.Barrier(2)

    def begin(folder: Location, wanted: Identity) -> int:
        barrier.wait(60)
        with suppress(ValueError):
            return create(folder, wanted).identity.seed
        return 0

    for attempt in range(6):
        folder = place / str(attempt)
        rivals = [replace(identity, seed=seed) for seed in (1, 2)]
        with ThreadPoolExecutor(2) as writers:
            began = [seed for seed in writers.map(begin, [folder] * 2, rivals) if seed]
        assert len(began) < 2
        assert [open_dataset(folder).identity.seed] == began if began else not content(folder)


def test_a_claim_counts_while_its_writer_may_live(place, identity):
    other = manifest_text(replace(identity, seed=6))
    elsewhere = place / WRITING / f"{MANIFEST}.0123.another-machine.boot.7"
    elsewhere.write_text(other)
    with pytest.raises(ValueError, match="differ in seed: 6 and 5"):
        create(place, identity)
    assert content(place) == {}
    elsewhere.unlink()
    (place / WRITING / f"{MANIFEST}.0123.{writer().rpartition('.')[0]}.{2**22 + 1}").write_text(other)
    assert create(place, identity).identity == identity
    assert shards.sweep(place) == 1


def test_a_shard_that_fails_while_it_is_written_leaves_nothing(place, identity):
    dataset = create(place, identity)

    def fail(path: Path) -> None:
        path.write_bytes(b"half of a sh")
        raise OSError("no more")

    with pytest.raises(OSError, match="no more"):
        shards.commit(place, FIRST, fail)
    assert list(content(dataset.folder)) == [MANIFEST]
