"""The record of a run: every trial once, and damage named."""

import json
import math
from dataclasses import replace
from pathlib import Path

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


def test_a_failed_trial_is_strict_json_and_reads_as_what_it_was(tmp_path):
    path = tmp_path / "se-00000.jsonl"
    failed = replace(trial(0), f=math.nan, y=math.nan, best=math.nan, status="failed", success=False)
    append(path, failed)
    line = json.loads(path.read_text(), parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert (line["f"], line["y"], line["best"], line["status"]) == (None, None, None, "failed")
    [found] = read_trials(path)
    assert all(math.isnan(number) for number in (found.f, found.y, found.best))
    assert (found.index, found.status) == (0, "failed")


def test_the_nan_of_a_released_version_is_read(tmp_path):
    path = tmp_path / "se-00000.jsonl"
    line = {"trial": 0, "f": math.nan, "y": 0.5, "best": math.nan, "success": False, "status": "failed"}
    path.write_text(json.dumps({**line, "seconds": 0.1, "stop": "", "x": [0.0, 1.0]}) + "\n")
    assert "NaN" in path.read_text()
    [found] = read_trials(path)
    assert (math.isnan(found.f), math.isnan(found.best), found.y) == (True, True, 0.5)


def test_a_trial_with_an_objective_has_the_bytes_that_released_versions_wrote(tmp_path):
    kept = Path(__file__).parents[2] / "released" / "v0_1_0" / "comparison" / "runs" / "se-00000.jsonl"
    for found in read_trials(kept):
        append(tmp_path / kept.name, found)
    assert (tmp_path / kept.name).read_bytes() == kept.read_bytes()


@pytest.mark.slow
def test_a_damaged_record_is_refused_naming_its_line(compared):
    path = RunKey("random", 1000).path(compared("random", runs=1))
    path.write_text(path.read_text().replace('"f"', '"g"', 1))
    with pytest.raises(UserError, match=r"line 1 of .*random-01000.jsonl is not the record of a trial"):
        compared("random", runs=2)
