"""The record of a run: every trial once, and damage named."""

import pytest

from cluster.comparison.records import RunKey, append, read_trials
from cluster.errors import UserError
from tests.cluster.comparison.comparing import trial


def test_a_trial_recorded_twice_counts_once_and_one_after_a_gap_does_not(tmp_path):
    path = tmp_path / "se-00000.jsonl"
    for index, seconds in ((0, 0.1), (1, 0.2), (1, 0.3), (3, 0.4)):
        append(path, trial(index, seconds))
    assert [(found.index, found.seconds) for found in read_trials(path)] == [(0, 0.1), (1, 0.2)]


def test_the_next_trial_replaces_a_line_that_was_cut_off(tmp_path):
    path = tmp_path / "se-00000.jsonl"
    append(path, trial(0))
    path.write_bytes(path.read_bytes() + b'{"trial": 1, "f"')
    append(path, trial(1))
    assert [found.index for found in read_trials(path)] == [0, 1]
    assert path.read_bytes().count(b"\n") == 2


def test_a_damaged_record_is_refused_naming_its_line(compared):
    path = RunKey("random", 1000).path(compared("random", runs=1))
    path.write_text(path.read_text().replace('"f"', '"g"', 1))
    with pytest.raises(UserError, match=r"line 1 of .*random-01000.jsonl is not the record of a trial"):
        compared("random", runs=2)
