"""The arrays of a cache on disk: opened only as they were made."""

import json

import numpy as np
import pytest

from workers.dataset.cache_files import READY, finish, is_finished, make, open_arrays


def layout_of(episodes: int):
    return {"x": (np.float32, (episodes, 2)), "episode": (np.int64, (episodes,))}


@pytest.fixture
def folder(tmp_path):
    """Three finished rows."""
    arrays = make(tmp_path, layout_of(3))
    arrays["x"][:] = [[1, 2], [3, 4], [5, 6]]
    arrays["episode"][:] = [7, 8, 9]
    for array in arrays.values():
        array.flush()
    assert not is_finished(tmp_path)
    finish(tmp_path, layout_of(3), {"episodes": 3})
    return tmp_path


def test_arrays_come_back_as_they_were_written_and_cannot_be_changed(folder):
    assert is_finished(folder)
    arrays = open_arrays(folder, layout_of)
    assert arrays["x"].tolist() == [[1, 2], [3, 4], [5, 6]]
    assert arrays["episode"].tolist() == [7, 8, 9]
    with pytest.raises(ValueError, match="read-only"):
        arrays["x"][0] = 0


def test_a_flipped_bit_is_found_by_the_checksum(folder):
    path = folder / "x.npy"
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"the bytes of x\.npy are not those of its checksum.*delete"):
        open_arrays(folder, layout_of)


def test_arrays_of_another_shape_are_refused_even_where_there_are_no_checksums(folder):
    (folder / READY).write_text(json.dumps({"episodes": 2}))
    with pytest.raises(ValueError, match=r"x\.npy must hold float32 \(2, 2\), got float32 \(3, 2\)"):
        open_arrays(folder, layout_of)


def test_a_missing_array_names_the_folder_to_delete(folder):
    (folder / "episode.npy").unlink()
    with pytest.raises(ValueError, match=r"the training cache .* is damaged: .*episode\.npy.*; delete"):
        open_arrays(folder, layout_of)
