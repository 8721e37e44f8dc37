"""Selections of rows, batches and the held-out tenth."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from svaedc.data.episodes import Episodes, split

CPU = torch.device("cpu")


def test_gathered_rows_are_those_of_the_selection_in_storage_order(episodes):
    selection = replace(episodes, rows=np.array([5, 9, 300]))
    batch = selection.gather(np.array([2, 0]), CPU)
    np.testing.assert_array_equal(batch.x, episodes.x[[5, 300]])
    np.testing.assert_array_equal(batch.xi, episodes.xi[[5, 300]])
    np.testing.assert_array_equal(batch.bad, episodes.bad[[5, 300]])
    np.testing.assert_array_equal(batch.y, episodes.y[[5, 300]])


def test_a_read_only_memory_map_is_gathered_like_an_array(episodes, tmp_path):
    np.save(tmp_path / "xi.npy", episodes.xi)
    mapped = replace(episodes, xi=np.load(tmp_path / "xi.npy", mmap_mode="r"))
    positions = np.array([7, 3])
    torch.testing.assert_close(mapped.gather(positions, CPU), episodes.gather(positions, CPU))


def test_the_rows_that_are_held_out_are_not_trained_on_and_all_others_are(episodes):
    selection = replace(episodes, rows=np.arange(100, 600))
    training, held_out = split(selection, np.array([599, 100, 250]))
    assert held_out.rows.tolist() == [100, 250, 599]
    assert sorted([*training.rows, *held_out.rows]) == list(range(100, 600))


def test_a_sample_is_part_of_the_selection_without_repetition(episodes):
    _, held_out = split(episodes, np.arange(9, 600, 10))
    sample = held_out.sample(20, np.random.default_rng(0))
    assert len(set(sample.rows)) == 20
    assert set(sample.rows) <= set(held_out.rows)
    assert len(held_out.sample(1_000, np.random.default_rng(0))) == len(held_out)


def test_arrays_of_different_lengths_are_refused(episodes):
    with pytest.raises(ValueError, match=r"equally long.*rebuild the cache"):
        Episodes(episodes.x, episodes.xi[:-1], episodes.bad, episodes.y, episodes.rows)


def test_rows_outside_the_arrays_are_refused(episodes):
    with pytest.raises(ValueError, match=r"rows must lie in 0\.\.599, got 3\.\.600"):
        replace(episodes, rows=np.array([3, 600]))


def test_held_out_rows_outside_the_selection_are_refused(episodes):
    with pytest.raises(ValueError, match="must be rows of the selection, got 599; take them from the same"):
        split(replace(episodes, rows=np.arange(599)), np.arange(9, 600, 10))
