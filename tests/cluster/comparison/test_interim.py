"""A comparison that was interrupted is reported from what there is."""

import json
import math

import pyarrow.parquet as pq
import pytest

from cluster.comparison.interim import comparable, describe, report
from cluster.comparison.plan import Grid, plan_comparison
from cluster.comparison.records import RunKey
from cluster.config import CompareSettings
from cluster.errors import UserError
from svaedc.bo.loop import Outcome, record
from tests.cluster.comparison.comparing import trial
from workers import setups

METHODS = ("random", "se")


def plan_of(folder):
    return plan_comparison(
        setup=setups.load("quadratic-30d"),
        grid=Grid(METHODS, seed=0, runs=2),
        trials=2,
        gap="paper",
        models=[],
        folder=folder,
        settings=CompareSettings(pool_size=50),
    )


def interrupted(folder, lengths: dict[str, list[int]], f: float = 30.0):
    """A plan whose folder holds the first trials of its runs."""
    plan = plan_of(folder)
    x = plan.job.optimization(RunKey("random", 0), plan.setup).initial(0)
    with plan.job.folder.alone():
        plan.claim()
        for method, each in lengths.items():
            for run, length in enumerate(each):
                best = math.nan
                for index in range(length):
                    made = record(index, x, Outcome(f + index, 0.1, success=False), best, 0.1)
                    best = made.best
                    plan.job.folder.append(RunKey(method, run), made)
    return plan


def strict(path):
    return json.loads(path.read_text(), parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))


def test_whole_runs_are_reported_and_the_others_are_named(tmp_path, capsys):
    plan = interrupted(tmp_path / "out", {"random": [4, 4], "se": [4, 1]})
    summary = report(plan)
    assert {name: (each.runs, each.incomplete) for name, each in summary.methods.items()} == {
        "random": (2, 0),
        "se": (1, 1),
    }
    told = capsys.readouterr().err
    assert "1 of 4 runs is not whole (4 trials each): se 1 has 1 trial. `svaedc compare` goes on" in told
    assert "1 run, 1 run not whole" in told
    assert "nan" not in told
    page = (tmp_path / "out" / "report.html").read_text()
    assert "1 of 4 runs is not whole" in page
    written = strict(tmp_path / "out" / "summary.json")
    assert written["missing"] == [{"method": "se", "run": 1, "trials": 1, "of": 4}]
    assert describe(plan, summary) == {**written, "folder": str(tmp_path / "out")}
    assert (tmp_path / "out" / "figure.png").exists()


def test_while_no_run_is_whole_all_are_compared_over_the_trials_that_they_share(tmp_path):
    plan = interrupted(tmp_path / "out", {"random": [3, 2], "se": [3, 0]})
    summary = report(plan)
    assert summary.trials == 2
    assert [each.runs for each in summary.methods.values()] == [2, 1]
    assert pq.read_table(tmp_path / "out" / "trials.parquet").num_rows == 8
    assert "3 random, shared" not in (tmp_path / "out" / "report.html").read_text()


def test_a_method_whose_trials_all_failed_is_reported_too(tmp_path, capsys):
    plan = interrupted(tmp_path / "out", {"random": [4, 4], "se": [4, 4]}, f=math.nan)
    report(plan)
    told = capsys.readouterr().err
    assert "random: no objective after 4 trials, 8 of 8 trials failed, 2 runs" in told
    assert "No method has an objective after 4 trials: nothing can be compared." in told
    strict(tmp_path / "out" / "summary.json")


def test_the_command_goes_on_where_it_was_after_a_report(tmp_path):
    plan = interrupted(tmp_path / "out", {"random": [4, 4], "se": [4, 1]})
    before = plan.job.folder.runs()
    report(plan)
    assert [str(key) for key in plan.missing(plan.job.folder.runs())] == ["se 1"]
    assert plan.job.folder.runs().keys() == before.keys()


def test_a_folder_without_trials_is_refused_and_not_made(tmp_path):
    with pytest.raises(UserError, match="holds no trials to report: run the same command without --report"):
        report(plan_of(tmp_path / "none"))
    assert not (tmp_path / "none").exists()


def test_runs_are_cut_only_while_none_is_whole():
    runs = {RunKey("se", 0): [trial(0), trial(1), trial(2)], RunKey("se", 1): [trial(0), trial(1)]}
    for length, lengths in ((3, [3, 2]), (4, [2, 2])):
        assert [len(trials) for trials in comparable(runs, length).values()] == lengths
