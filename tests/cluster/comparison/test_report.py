"""A comparison in which things go wrong: trials without an objective, and a threshold nobody reaches."""

import json
import math
from dataclasses import dataclass, replace

import numpy as np
import pyarrow.parquet as pq
import pytest

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.report import lines, publish, summary_of
from cluster.comparison.worker import ComparisonJob
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Row
from workers import setups
from workers.attempts import Attempts
from workers.tasks.quadratic import Quadratic


@dataclass(frozen=True)
class Moody(Quadratic):
    """A quadratic that cannot be measured for a third of all controllers."""

    def objective(self, observed, bad):
        f = super().objective(observed, bad)
        return math.nan if observed.xi[5, -1] > 2 / 3 else f


SETUP = replace(setups.load("quadratic-30d-intrinsic-3"), task=Moody(30, 3), success=100.0)
KEYS = [RunKey(method, run) for run in (1000, 1001) for method in ("random", "se")]


def job_in(folder) -> ComparisonJob:
    (folder / "runs").mkdir(parents=True)
    return ComparisonJob(ComparisonFolder(folder), SETUP.name, "paper", (), pool_size=60, initial=2, trials=6)


def run(job: ComparisonJob, key: RunKey) -> None:
    with Attempts(SETUP) as attempts:
        for _ in job.run(key, SETUP, attempts):
            pass


@pytest.fixture(scope="module")
def job(tmp_path_factory) -> ComparisonJob:
    """Four runs, each at its end."""
    made = job_in(tmp_path_factory.mktemp("mishaps") / "whole")
    for key in KEYS:
        run(made, key)
    return made


def test_a_trial_without_an_objective_is_marked_counts_for_nothing_and_is_not_tried_again(job):
    for trials in job.folder.runs().values():
        assert len(trials) == 8
        for trial in trials:
            is_failed = bool(trial.x[5] > 2 / 3)
            assert (trial.status == "failed", math.isnan(trial.f)) == (is_failed, is_failed)
        measured = [trial.f for trial in trials if trial.status == "ok"]
        assert trials[-1].best == max(measured)
        assert len({trial.x.tobytes() for trial in trials}) == 8
    assert any(trial.status == "failed" for key, trials in job.folder.runs().items() for trial in trials)


def test_a_run_goes_on_after_a_trial_without_an_objective_as_if_it_had_not_stopped(job, tmp_path):
    key = next(
        key for key, trials in job.folder.runs().items() if "failed" in [trial.status for trial in trials[:7]]
    )
    again = job_in(tmp_path / "again")
    whole = key.path(job.folder.path).read_bytes().splitlines(keepends=True)
    key.path(again.folder.path).write_bytes(b"".join(whole[:7]))
    run(again, key)
    [trials] = again.folder.runs().values()
    assert [trial.x.tobytes() for trial in trials] == [
        trial.x.tobytes() for other, found in job.folder.runs().items() if other == key for trial in found
    ]


def test_the_report_explains_missing_objectives_and_a_threshold_nobody_reached(job):
    runs = job.folder.runs()
    summary = summary_of(job, SETUP, runs)
    publish(job, SETUP, runs, summary, {})
    page = (job.folder.path / "report.html").read_text()
    assert "trials failed: they gave no objective. They teach no method anything" in page
    assert "Nobody reached the threshold of success" in page
    assert "not reached" in page
    written = (job.folder.path / "summary.json").read_text()
    found = json.loads(written, parse_constant=lambda name: pytest.fail(f"{name} is no JSON"))
    assert found["title"] == "quadratic-30d-intrinsic-3: Bayesian optimisation"  # a formula hides no physics
    assert all(method["successful_runs"]["mean"] == 0 for method in found["methods"].values())
    failed = [trial.status for trials in runs.values() for trial in trials if trial.index >= 2].count(
        "failed"
    )
    shares = [method["failed_trials"]["mean"] for method in found["methods"].values()]
    assert sum(shares) * 12 == pytest.approx(failed)
    all_failed = sum(trial.status == "failed" for trials in runs.values() for trial in trials)
    assert sum(method["failed"] for method in found["methods"].values()) == all_failed
    assert f"{all_failed} of 32 trials failed" in page
    table = pq.read_table(job.folder.path / "trials.parquet").to_pylist()
    assert {row["status"] for row in table if math.isnan(row["f"])} == {"failed"}
    *methods, last = lines(summary)
    assert all("best after 8 trials" in line for line in methods)
    assert ["of 16 trials failed" in line for line in methods] == [
        method.failed > 0 for method in summary.methods.values()
    ]
    assert "too few runs to tell it from" in last
    assert found["verdict"] == last
    assert {each["judgement"] for each in found["differences"]} == {"too few runs"}


@pytest.mark.parametrize("f", [0.5, math.nan])
def test_lines_of_one_run_or_failed_ones_have_no_nan_and_the_right_number(f):
    rows = [Row("se", 0, index, f, success=False) for index in range(4)]
    [line, _] = lines(summarize(rows, Reporting(), np.random.default_rng(0)))
    assert line.endswith(", 1 run")
    assert "nan" not in line
    assert ("4 of 4 trials failed" in line) == math.isnan(f)
    assert "[" not in line
