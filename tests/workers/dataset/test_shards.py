"""Which shards exist, and how one comes to be: once, whole, whatever dies meanwhile."""

import errno
import os
import shutil
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers.dataset import schema, shards
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import WRITING, is_dead, wait_for_end, writer

SHARD = Shard(8, 16)
CONTENT = b"episodes " * 5000

KILLED_AT = """
import os, signal, sys
from pathlib import Path
from workers.dataset import shards

folder, fatal, seen = Path(sys.argv[1]), int(sys.argv[2]), 0

def die(event, arguments):
    global seen
    writes = event in ("open", "os.mkdir", "os.rename", "os.link", "os.remove")
    if writes and str(folder) in str(arguments[0]):
        seen += 1
        if seen == fatal:
            os.kill(os.getpid(), signal.SIGKILL)

def write(path):
    for part in range(5):
        with path.open("ab") as file:
            file.write(b"episodes " * 1000)

sys.addaudithook(die)
shards.commit(folder, shards.Shard(8, 16), write)
"""


runs = st.lists(st.tuples(st.integers(1, 60), st.integers(0, 2**16 - 1)), max_size=4)
partial_datasets = st.tuples(st.integers(1, 12), runs)


def _left_by(runs: list[tuple[int, int]], per_shard: int) -> list[Shard]:
    """What runs for growing totals left behind; bit i of a run's mask: its i-th shard survived."""
    done: list[Shard] = []
    for total, mask in sorted(runs):
        new = list(shards.missing(done, total, per_shard))
        done += [shard for number, shard in enumerate(new) if mask >> (number % 16) & 1]
    return done


@given(partial_datasets, st.integers(0, 80))
def test_present_and_missing_shards_cover_every_episode_once(partial, episodes):
    per_shard, done = partial[0], _left_by(partial[1], partial[0])
    new = list(shards.missing(done, episodes, per_shard))
    indices = [index for shard in (*done, *new) for index in range(shard.start, shard.stop)]
    assert len(set(indices)) == len(indices)
    assert set(range(episodes)) <= set(indices)
    assert {index for shard in new for index in range(shard.start, shard.stop)} <= set(range(episodes))


@given(partial_datasets, st.integers(0, 80))
def test_missing_shards_are_no_larger_than_asked_and_never_cross_a_file_boundary(partial, episodes):
    per_shard, done = partial[0], _left_by(partial[1], partial[0])
    for shard in shards.missing(done, episodes, per_shard):
        assert shard.start // per_shard == (shard.stop - 1) // per_shard


@given(partial_datasets, st.integers(0, 80))
def test_nothing_is_missing_once_the_missing_is_there(partial, episodes):
    per_shard, done = partial[0], _left_by(partial[1], partial[0])
    new = list(shards.missing(done, episodes, per_shard))
    assert list(shards.missing([*done, *new], episodes, per_shard)) == []


@given(ranges=st.lists(st.tuples(st.integers(0, 60), st.integers(1, 20)), max_size=8))
def test_an_episode_in_several_shards_counts_once(ranges):
    present = [Shard(start, start + size) for start, size in ranges]
    assert shards.episodes_in(present) == len(
        {i for shard in present for i in range(shard.start, shard.stop)}
    )


def test_an_extension_completes_the_partial_file_with_a_further_one():
    assert list(shards.missing([], 300, 256)) == [Shard(0, 256), Shard(256, 300)]
    assert list(shards.missing([Shard(0, 256), Shard(256, 300)], 600, 256)) == [
        Shard(300, 512),
        Shard(512, 600),
    ]


@pytest.mark.parametrize(("start", "stop"), [(-1, 4), (4, 4), (5, 4)])
def test_empty_and_negative_shards_are_refused(start, stop):
    with pytest.raises(ValueError, match="0 <= start < stop"):
        Shard(start, stop)


def test_a_committed_shard_has_its_content_its_digest_and_nothing_else(tmp_path):
    path = shards.commit(tmp_path, SHARD, lambda target: target.write_bytes(CONTENT))
    assert path.read_bytes() == CONTENT
    assert shards.present(tmp_path) == [SHARD]
    assert sorted(p.name for p in tmp_path.iterdir()) == [WRITING, SHARD.name, f"{SHARD.name}.sha256"]
    assert list((tmp_path / WRITING).iterdir()) == []


def test_the_digest_is_what_sha256sum_checks(tmp_path):
    shards.commit(tmp_path, SHARD, lambda target: target.write_bytes(CONTENT))
    checked = subprocess.run(
        ["sha256sum", "--check", "--strict", f"{SHARD.name}.sha256"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
    )
    assert checked.returncode == 0, checked.stderr
    assert checked.stdout == f"{SHARD.name}: OK\n"


def test_the_first_of_several_writers_wins(tmp_path):
    shards.commit(tmp_path, SHARD, lambda target: target.write_bytes(CONTENT))
    shards.commit(tmp_path, SHARD, lambda target: target.write_bytes(b"late"))
    assert (tmp_path / SHARD.name).read_bytes() == CONTENT
    assert shards.recorded_digest(tmp_path, SHARD) == shards.sha256(tmp_path / SHARD.name)
    assert list((tmp_path / WRITING).iterdir()) == []


def test_a_writer_that_fails_leaves_nothing(tmp_path):
    def fail(target: Path) -> None:
        target.write_bytes(CONTENT)
        raise RuntimeError("the simulator died")

    with pytest.raises(RuntimeError, match="simulator died"):
        shards.commit(tmp_path, SHARD, fail)
    assert shards.present(tmp_path) == []
    assert [path.name for path in tmp_path.iterdir()] == [WRITING]
    assert list((tmp_path / WRITING).iterdir()) == []


def test_a_full_disk_is_an_os_error_and_publishes_nothing(tmp_path, identity, episodes_of):
    def write(target: Path) -> None:
        target.symlink_to("/dev/full")
        schema.write(target, identity, 8, episodes_of(identity, range(8, 16)))

    with pytest.raises(OSError, match="No space left") as caught:
        shards.commit(tmp_path, SHARD, write)
    assert caught.value.errno == errno.ENOSPC
    assert shards.present(tmp_path) == []
    assert [path.name for path in tmp_path.iterdir()] == [WRITING]
    assert list((tmp_path / WRITING).iterdir()) == []


def test_a_writer_killed_at_any_moment_leaves_a_dataset_that_a_rerun_completes(tmp_path):
    whole = tmp_path / "whole"
    whole.mkdir()
    shards.commit(whole, SHARD, lambda target: target.write_bytes(CONTENT))
    expected = {path.name: path.read_bytes() for path in whole.iterdir() if path.is_file()}
    survived_after = 0
    for moment in range(1, 60):
        folder = tmp_path / "killed"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        died = subprocess.run([sys.executable, "-c", KILLED_AT, str(folder), str(moment)], timeout=180)
        if died.returncode == 0:
            survived_after = moment
            break
        assert died.returncode == -signal.SIGKILL
        for shard in shards.present(folder):
            assert shards.recorded_digest(folder, shard) == shards.sha256(folder / shard.name)
        if not shards.present(folder):
            shards.commit(folder, SHARD, lambda target: target.write_bytes(CONTENT))
        shards.sweep(folder)
        assert {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()} == expected
        assert not (folder / WRITING).exists() or list((folder / WRITING).iterdir()) == []
    assert survived_after > 12


def test_sweeping_spares_living_writers_and_those_of_other_machines(tmp_path):
    writing = tmp_path / WRITING
    writing.mkdir()
    gone = subprocess.Popen([sys.executable, "-c", "pass"])
    gone.wait()
    host, boot, _ = writer().split(".")
    living = [
        f"{SHARD.name}.{writer()}",
        f"{SHARD.name}.{host}.{boot}.{os.getppid()}",
        f"{SHARD.name}.elsewhere.{boot}.{gone.pid}",
        f"{SHARD.name}.{host}.{boot.partition('_')[0]}_1.{gone.pid}",  # in another container of this machine
        "somebody's notes",
    ]
    dead = [
        f"{SHARD.name}.{host}.{boot}.{gone.pid}",
        f"{SHARD.name}.{host}.another-boot.{os.getpid()}",
        f"{SHARD.name}.{host}.another-boot_1.{os.getpid()}",
        f"{SHARD.name}.{host}.{boot.partition('_')[0]}.{gone.pid}",  # where nobody tells of containers
        f"{SHARD.name}.{host}.{boot}.{os.getpid()}_1",  # of a process that had this one's id before it
    ]
    for name in (*living, *dead):
        (writing / name).write_bytes(b"half")
    assert shards.sweep(tmp_path) == len(dead)
    assert sorted(path.name for path in writing.iterdir()) == sorted(living)


def test_waiting_for_a_writer_lasts_until_its_process_is_gone_and_no_longer_than_allowed():
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as process:
        host, boot, _ = writer().split(".")
        names = [f"{host}.{boot}.{process.pid}", f"elsewhere.{boot}.1", f"{host}.another-boot.{process.pid}"]
        wait_for_end(names, 0.0)
        assert not is_dead(names[0])
        threading.Timer(0.3, process.communicate).start()  # its end: input() finds nothing more
        wait_for_end(names, 60.0)
        assert is_dead(names[0])


def test_a_writer_whose_parent_never_asks_how_it_ended_is_dead():
    """As in a container whose first process collects nobody's children."""
    with subprocess.Popen([sys.executable, "-c", "pass"]) as process:
        host, boot, _ = writer().split(".")
        wait_for_end([f"{host}.{boot}.{process.pid}"], 60.0)
        assert process.returncode is None
        assert is_dead(f"{host}.{boot}.{process.pid}")


def test_sweeping_a_folder_that_never_wrote_is_harmless(tmp_path):
    assert shards.sweep(tmp_path) == 0


def test_other_files_in_the_folder_are_no_shards(tmp_path):
    for name in ("notes.txt", "episodes-1-2.parquet", f"{SHARD.name}.sha256", f"x{SHARD.name}"):
        (tmp_path / name).write_bytes(b"")
    assert shards.present(tmp_path) == []


@pytest.mark.parametrize("content", ["", "\n", "   "])
def test_an_empty_digest_file_counts_as_none(tmp_path, content):
    shards.digest_path(tmp_path, SHARD).write_text(content)
    assert shards.recorded_digest(tmp_path, SHARD) == ""
