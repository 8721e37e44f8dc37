"""`svaedc compare` on a real cluster: shared beginnings, extended, and refused if it misfits."""

import json
from base64 import b64encode

import pytest

from cluster.errors import UserError
from cluster.tracking import open_tracker
from tests.cluster.comparison.comparing import mlflow_runs, table, untrained


@pytest.mark.slow
def test_a_comparison_writes_a_table_a_summary_and_figures(compared, tmp_path, tracking_settings):
    out = compared("random,screened-random,svae-dc", models=[untrained(tmp_path / "model")])
    rows = table(out)
    assert len(rows) == 3 * 2 * 4
    assert [*rows[0]] == [
        *("setup", "gap", "method", "run", "trial", "f", "y", "best", "success", "status", "stop", "x"),
    ]
    for run in (1000, 1001):
        first = [row for row in rows if row["run"] == run and row["trial"] < 2]
        for index in (0, 1):
            same = [(row["x"], row["f"]) for row in first if row["trial"] == index]
            assert len(same) == 3
            assert same[0] == same[1] == same[2]
    for row in rows:
        earlier = [r["f"] for r in rows if (r["method"], r["run"]) == (row["method"], row["run"])]
        assert row["best"] == max(earlier[: row["trial"] + 1])
    summary = json.loads((out / "summary.json").read_text())
    assert summary["methods"].keys() == {"random", "screened-random", "svae-dc"}
    assert summary["trials"] == 4
    assert (out / "figure.png").stat().st_size > 10_000
    assert (out / "figure.svg").read_text().count("<path") > 10
    report = (out / "report.html").read_text()
    for shown in ("tuning seeds", "screened-random", "pool_size", "version of botorch", "MLflow run"):
        assert shown in report
    assert b64encode((out / "figure.svg").read_bytes()).decode() in report
    [parent], children = mlflow_runs(tracking_settings)
    assert {run.data.tags["mlflow.parentRunId"] for run in children} == {parent.info.run_id}
    assert len(children) == 6
    client = open_tracker(tracking_settings).client
    assert len(client.get_metric_history(children[0].info.run_id, "best")) == 4
    assert client.list_artifacts(parent.info.run_id, "figures")


@pytest.mark.slow
def test_the_same_command_again_does_nothing_and_names_the_same_run(compared, tracking_settings, capsys):
    out = compared("random")
    before = {
        path: path.stat().st_mtime_ns for path in out.rglob("*") if path.is_file() and path.name[0] != "."
    }
    capsys.readouterr()
    compared("random")
    assert "nothing to do" in capsys.readouterr().err
    assert before == {path: path.stat().st_mtime_ns for path in before}
    parents, children = mlflow_runs(tracking_settings)
    assert (len(parents), len(children)) == (1, 2)


@pytest.mark.slow
def test_more_runs_and_methods_extend_a_comparison(compared, tracking_settings):
    before = table(compared("random", runs=1))
    after = table(compared("random,se", runs=2))
    assert [row for row in after if row["method"] == "random" and row["run"] == 1000] == before
    assert len(after) == 16
    _, children = mlflow_runs(tracking_settings)
    assert sorted(run.info.run_name for run in children) == [
        "random 1000",
        "random 1001",
        "se 1000",
        "se 1001",
    ]


@pytest.mark.slow
def test_a_comparison_runs_under_the_gap_it_was_asked_for(compared, tmp_path):
    paper, wide = (table(compared("random", gap=gap, folder=tmp_path / gap)) for gap in ("paper", "wide"))
    assert [row["x"] for row in paper] == [row["x"] for row in wide]
    assert all(one["f"] != other["f"] for one, other in zip(paper, wide, strict=True))


@pytest.mark.slow
def test_an_explicit_gap_is_recorded_by_its_ranges_however_they_are_written(compared):
    out = compared("random", gap="object2_mass=2,object1_friction=0.2:0.40", runs=1)
    level = "object1_friction=0.2:0.4,object2_mass=2.0:2.0"
    assert {row["gap"] for row in table(out)} == {level}
    assert compared("random", gap=level, runs=1) == out
    with pytest.raises(UserError, match="holds a comparison with gap"):
        compared("random", gap="object2_mass=2.1", runs=1)


@pytest.mark.slow
def test_the_model_belongs_to_a_comparison_from_the_first_method_that_needs_one(compared, tmp_path):
    one, other = untrained(tmp_path / "one"), untrained(tmp_path / "other", seed=1)
    compared("random", runs=1)
    compared("random", models=[other], runs=1)
    compared("random,svae", models=[one], runs=1)
    compared("se", models=[other], runs=1)
    out = compared("matern", runs=1)
    assert {row["method"] for row in table(out)} == {"random", "svae", "se", "matern"}
    with pytest.raises(UserError, match=r"holds a comparison with model '\w+', not '\w+'"):
        compared("svae-dc", models=[other], runs=1)
