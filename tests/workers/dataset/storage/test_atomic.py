"""How a file comes to be on a disk: whole, under its name, once."""

import pytest

from workers.dataset.storage.atomic import link, move, temporary_file
from workers.dataset.storage.temporary import WRITING, writer


def test_an_unfinished_file_bears_its_writers_name_and_is_gone_afterwards(tmp_path):
    with temporary_file(tmp_path, "a.parquet") as path:
        assert path == tmp_path / WRITING / f"a.parquet.{writer()}"
        path.write_bytes(b"half")
    assert list((tmp_path / WRITING).iterdir()) == []


def test_a_writer_that_fails_leaves_nothing(tmp_path):
    def fail() -> None:
        with temporary_file(tmp_path, "a") as path:
            path.write_bytes(b"half")
            raise OSError("no more")

    with pytest.raises(OSError, match="no more"):
        fail()
    assert list((tmp_path / WRITING).iterdir()) == []


def test_the_first_of_two_writers_gives_the_file_its_content(tmp_path):
    for content in (b"first", b"second"):
        with temporary_file(tmp_path, "a") as path:
            path.write_bytes(content)
            link(path, tmp_path / "a")
    assert (tmp_path / "a").read_bytes() == b"first"


def test_what_is_moved_takes_the_place_of_what_was_there(tmp_path):
    (tmp_path / "a").write_bytes(b"first")
    with temporary_file(tmp_path, "a") as path:
        path.write_bytes(b"second")
        move(path, tmp_path / "a")
        assert not path.exists()
    assert (tmp_path / "a").read_bytes() == b"second"
