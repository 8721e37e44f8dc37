"""The cells of a study: computed once, kept, and none computed again."""

import json

import pytest


def cells(count: int):
    from studies.learning_curve import Cell

    return [Cell("fingerprint", 1_000 * number, 10, 0) for number in range(1, count + 1)]


def refused(cell):
    raise AssertionError(f"{cell} was computed again")


def test_a_kept_result_is_found_by_its_cell_and_not_computed_again(tmp_path):
    from studies.cells import Study, results

    study, (first, second, third) = Study(tmp_path), cells(3)
    for cell, value in ((third, 3.0), (first, 1.0), (second, 2.0)):
        study.keep(cell, {"value": value})
    found = results(study, [first, second, third], refused, 1.0, 1)
    assert [result["value"] for result in found] == [1.0, 2.0, 3.0]


def test_a_line_that_was_cut_off_costs_only_its_own_cell(tmp_path):
    from studies.cells import Study

    study, (first, second, third) = Study(tmp_path), cells(3)
    study.keep(first, {"value": 1.0})
    study.keep(second, {"value": 2.0})
    path = tmp_path / "cells.jsonl"
    path.write_text(path.read_text()[:-9])
    study.keep(third, {"value": 3.0})
    assert sorted(result["value"] for result in study.kept().values()) == [1.0, 3.0]
    assert [json.loads(line)["cell"]["count"] for line in path.read_text().splitlines()[::2]] == [1000, 3000]


@pytest.mark.slow
def test_what_is_missing_is_computed_in_other_processes_and_kept(tmp_path):
    from dataclasses import asdict

    from studies.cells import Study, results

    study, (first, second) = Study(tmp_path), cells(2)
    study.keep(first, {"count": -1})
    found = results(study, [first, second], asdict, 1.0, 1)
    assert [result["count"] for result in found] == [-1, 2000]
    assert Study(tmp_path).kept().keys() == study.kept().keys()
    assert len(study.kept()) == 2


def test_sizes_double_and_end_with_all_there_is():
    from studies.learning_curve import counts

    assert counts(20_506) == [2000, 4000, 8000, 16000, 20506]
    assert counts(17_000) == [2000, 4000, 8000, 17000]
    assert counts(1_000) == [1000]


def test_a_line_over_doublings_is_continued_exactly():
    from studies.learning_curve import extrapolated

    slope, far = extrapolated([1000, 2000, 4000, 8000], [9.0, 0.7, 0.6, 0.5], 32_000)
    assert slope == pytest.approx(-0.1)
    assert far == pytest.approx(0.3)
