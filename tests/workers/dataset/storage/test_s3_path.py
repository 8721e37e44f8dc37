"""A dataset in an object store: the bytes, the promises and the refusals of one on a disk."""

import math
import signal
import socket
import subprocess
import sys
import threading
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from workers.dataset import schema, shards
from workers.dataset.cache import training_cache
from workers.dataset.exports.npz import export_npz
from workers.dataset.folder import MANIFEST, Dataset, create, open_dataset
from workers.dataset.identity import Identity
from workers.dataset.inventory import inventory, sweep_digests
from workers.dataset.manifest import manifest_text
from workers.dataset.replacement import REPLACED, Repair
from workers.dataset.replacement import replace as put_right
from workers.dataset.shards import Shard
from workers.dataset.statistics import statistics
from workers.dataset.storage.location import Location, location
from workers.dataset.storage.s3 import StoreError, reaching
from workers.dataset.storage.temporary import WRITING, writer
from workers.dataset.verification import verify

FIRST, MIDDLE, LAST = Shard(0, 8), Shard(8, 16), Shard(16, 20)


@pytest.fixture
def address(object_store, bucket) -> str:
    return f"s3://{bucket}/some/data?endpoint_override={object_store}&region=us-east-1&scheme=http"


@pytest.fixture
def place(address) -> Location:
    """Where nothing is yet."""
    return location(address)


@pytest.fixture
def remote(place, identity, fill) -> Dataset:
    """The same three shards as those of `dataset`, in the store."""
    created = create(place, identity)
    fill(created, 20)
    return created


def content(folder: Location) -> dict[str, bytes]:
    paths = [path for path in folder.iterdir() if path.name != WRITING]
    return {path.name: path.read_bytes() for path in paths}


def problems(dataset: Dataset) -> dict[str, str]:
    found = [*inventory(dataset), *(each for _, several in verify(dataset) for each in several)]
    return {problem.file: problem.what for problem in found}


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


@pytest.mark.parametrize("answer", ["NO_SUCH_KEY during GetObject", "RESOURCE_NOT_FOUND during GetObject"])
def test_an_object_that_goes_while_it_is_read_is_missing_and_no_fault_of_the_store(answer):
    with pytest.raises(FileNotFoundError), reaching("s3://bucket/key"):
        raise OSError(f"When reading information for key 'key': AWS Error {answer} operation: ")
    with pytest.raises(StoreError, match="check its region"), reaching("s3://bucket"):
        raise OSError("AWS Error RESOURCE_NOT_FOUND during ListObjectsV2 operation: ")


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


UPLOAD = """
import sys
from workers.dataset.storage.location import location
location(sys.argv[1]).write_bytes(bytes(int(sys.argv[2])))
"""


@pytest.mark.parametrize("size", [9_000_000, 25_000_000], ids=["one request", "several parts"])
def test_an_upload_that_is_killed_half_way_leaves_nothing(size, object_store, bucket):
    with Relay(object_store, size // 2) as relay:
        options = f"endpoint_override={relay.address}&region=us-east-1&scheme=http"
        command = [sys.executable, "-c", UPLOAD, f"s3://{bucket}/file?{options}", str(size)]
        with subprocess.Popen(command) as process:
            assert relay.is_half_way.wait(120)
            process.kill()
        assert process.returncode == -signal.SIGKILL
    seen = location(f"s3://{bucket}?endpoint_override={object_store}&region=us-east-1&scheme=http")
    assert list(seen.iterdir()) == []
    (seen / "file").write_bytes(b"whole")
    assert content(seen) == {"file": b"whole"}


@pytest.mark.parametrize("part", [1, 2])
def test_an_upload_of_which_a_part_is_refused_leaves_nothing_and_can_be_repeated(part, object_store, bucket):
    with Relay(object_store, refused=f"partNumber={part}&".encode()) as relay:
        options = f"endpoint_override={relay.address}&region=us-east-1&scheme=http"
        command = [sys.executable, "-c", UPLOAD, f"s3://{bucket}/data/file?{options}", "25000000"]
        failed = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert failed.returncode == 1
    assert "StoreError" in failed.stderr
    seen = location(f"s3://{bucket}/data?endpoint_override={object_store}&region=us-east-1&scheme=http")
    assert list(seen.iterdir()) == list((seen / WRITING).iterdir()) == []
    (seen / "file").write_bytes(bytes(25_000_000))
    assert [(path.name, path.stat().st_size) for path in seen.iterdir()] == [("file", 25_000_000)]
    assert list((seen / WRITING).iterdir()) == []


REFUSAL = b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


class Relay:
    """Passes bytes between clients and a server.

    It keeps all after the first `limit` bytes of the clients, and refuses requests with some text in their
    first line.
    """

    def __init__(self, server: str, limit: float = math.inf, refused: bytes = b"") -> None:
        host, port = server.split(":")
        self.is_half_way = threading.Event()
        self._server, self._left, self._refused = (host, int(port)), limit, refused
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._sockets = [self._listener]
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"

    def __enter__(self) -> "Relay":
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        for each in self._sockets:
            each.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            server = socket.create_connection(self._server)
            self._sockets += [client, server]
            threading.Thread(target=self._upload, args=(client, server), daemon=True).start()
            threading.Thread(target=self._pass, args=(server, client), daemon=True).start()

    def _upload(self, client: socket.socket, server: socket.socket) -> None:
        while not self.is_half_way.is_set():
            block = client.recv(1 << 16)
            if not block:
                return
            if self._refused and self._refused in block.partition(b"\r\n")[0]:
                client.sendall(REFUSAL)
                client.close()
                return
            server.sendall(block)
            self._left -= len(block)
            if self._left <= 0:
                self.is_half_way.set()

    def _pass(self, source: socket.socket, target: socket.socket) -> None:
        try:
            while block := source.recv(1 << 16):
                target.sendall(block)
        except OSError:
            return


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


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ("s3:///data", "s3://bucket/prefix"),
        ("gs://bucket/data", "s3://bucket/prefix"),
        ("s3://key:secret@bucket/data", "holds no credentials"),
        ("s3://bucket/a/../b", "dotted parts"),
        ("s3://bucket/a?endpoint=127.0.0.1:9000", "endpoint_override, region, scheme"),
        ("s3://bucket/a?scheme=ftp", "http or https, got 'ftp'"),
    ],
)
def test_an_address_that_is_none_is_refused_with_what_was_expected(wrong, why):
    with pytest.raises(ValueError, match=why.replace("?", r"\?")):
        location(wrong)


@pytest.mark.parametrize(
    "text", ["s3://bucket", "s3://bucket/a/b", "s3://bucket/a?endpoint_override=127.0.0.1:9000&scheme=http"]
)
def test_an_address_is_written_as_it_was_read(text):
    assert str(location(text)) == text
    assert location(text) == location(f"{text}")
    assert (location("s3://bucket/") / "name").name == "name"


def test_a_bucket_that_is_missing_is_named(object_store, identity):
    nowhere = location(f"s3://nobody-s?endpoint_override={object_store}&region=us-east-1&scheme=http")
    for attempt in (lambda: open_dataset(nowhere), lambda: create(nowhere / "data", identity)):
        with pytest.raises(StoreError, match=r"no bucket for s3://nobody-s.*: create it"):
            attempt()


def test_a_store_that_is_away_is_no_damage_of_the_dataset(remote, free_port):
    nobody = (("endpoint_override", f"127.0.0.1:{free_port}"), ("region", "us-east-1"), ("scheme", "http"))
    gone = Dataset(replace(remote.folder, options=nobody), remote.identity)
    with pytest.raises(StoreError, match=r"does not answer .*: check the network, and AWS_ENDPOINT_URL"):
        schema.read_outcomes(gone.path(FIRST), gone.identity)


def test_refused_credentials_are_named_with_the_remedy(remote, object_store):
    demand(object_store, "0")
    try:
        with pytest.raises(StoreError, match=r"refuses access to s3://.*: set AWS_ACCESS_KEY_ID"):
            remote.shards()
        with pytest.raises(StoreError, match="refuses access"):
            remote.path(FIRST).write_bytes(b"mine")
    finally:
        demand(object_store, "inf")
    assert len(remote.shards()) == 3


def demand(object_store: str, after: str) -> None:
    """Lets the server ask for known credentials after that many requests."""
    request = urllib.request.Request(
        f"http://{object_store}/moto-api/reset-auth",
        data=after.encode(),
        headers={"Content-Type": "application/octet-stream"},
        method="POST",
    )
    urllib.request.urlopen(request, timeout=60).close()
