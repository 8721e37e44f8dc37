"""Damage of a dataset in an object store is named, put right, and swept."""

from dataclasses import replace

from tests.workers.dataset.storage.contents import FIRST, LAST, MIDDLE, content, problems
from workers.dataset import schema, shards
from workers.dataset.inventory import sweep_digests
from workers.dataset.replacement import REPLACED, Repair
from workers.dataset.replacement import replace as put_right
from workers.dataset.shards import Shard


def test_verify_names_what_is_flipped_lost_foreign_strange_or_without_its_digest(
    remote, identity, episodes_of
):
    stranger = remote.path(LAST).read_bytes()
    flipped = bytearray(remote.path(FIRST).read_bytes())
    flipped[len(flipped) // 2] ^= 1
    remote.path(FIRST).write_bytes(bytes(flipped))
    other = replace(identity, seed=9)
    rows = episodes_of(other, range(8, 16))
    remote.path(MIDDLE).unlink()
    shards.commit(remote.folder, MIDDLE, lambda path: schema.write(path, other, 8, rows))
    remote.path(LAST).unlink()
    (remote.folder / "copy.parquet").write_bytes(stranger)
    alone = Shard(20, 24)
    shards.commit(remote.folder, alone, lambda path: path.write_bytes(b"nothing"))
    shards.digest_path(remote.folder, alone).unlink()
    before = content(remote.folder)
    found = problems(remote)
    assert found.keys() == {FIRST.name, MIDDLE.name, LAST.name, alone.name, "copy.parquet"}
    assert "belongs to another dataset: seed: 5 and 9" in found[MIDDLE.name]
    assert found[LAST.name] == "it is missing: only its .sha256 file is there"
    assert found["copy.parquet"].startswith("no shard has such a name")
    assert content(remote.folder) == before


def test_a_broken_shard_is_put_right_and_what_was_there_is_kept(remote, dataset, episodes_of):
    rows = episodes_of(remote.identity, range(8, 16))
    remote.path(MIDDLE).write_bytes(b"broken")
    done = put_right(remote.folder, MIDDLE, lambda path: schema.write(path, remote.identity, 8, rows))
    assert done is Repair.REPLACED
    assert [path.read_bytes() for path in (remote.folder / REPLACED).iterdir()] == [b"broken"]
    assert content(remote.folder) == content(dataset.folder)


def test_a_digest_that_a_killed_writer_left_over_is_swept(remote):
    covered = Shard(8, 12)
    shards.digest_path(remote.folder, covered).write_text(shards.digest_line(covered, "0"))
    assert problems(remote).keys() == {f"{covered.name}.sha256"}
    assert sweep_digests(remote) == 1
    assert problems(remote) == {}
