"""A comparison goes on while its MLflow store fails, and catches up with it."""

import sqlite3
from contextlib import closing

import pytest

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.tracking import begin
from cluster.config import TrackingSettings
from cluster.errors import UserError
from cluster.tracking import open_tracker
from tests.cluster.comparison.comparing import mlflow_runs, table, trial


@pytest.mark.slow
def test_a_store_that_fails_meanwhile_costs_no_run_and_is_caught_up_with(compared, tracking_settings, capsys):
    out = compared("random", runs=1)
    with closing(sqlite3.connect(tracking_settings.uri.removeprefix("sqlite:///"))) as store:
        store.execute(
            "CREATE TRIGGER refusal BEFORE INSERT ON runs WHEN NEW.name LIKE 'random %' "
            "BEGIN SELECT RAISE(ABORT, 'refused'); END"
        )
        with pytest.raises(UserError, match=r"MLflow store .* cannot be used"):
            compared("random", runs=3)
        store.execute("DROP TRIGGER refusal")
    assert capsys.readouterr().err.count("The comparison goes on") == 1
    whole = table(out)
    assert len(whole) == 12
    assert table(compared("random", runs=3)) == whole
    parents, children = mlflow_runs(tracking_settings)
    assert sorted(run.info.run_name for run in children) == ["random 1000", "random 1001", "random 1002"]
    assert {run.info.status for run in parents + children} == {"FINISHED"}


def test_a_store_that_failed_once_is_left_alone_until_the_end(tmp_path, capsys):
    # One whose server accepts and stays silent would cost minutes for every run.
    store = TrackingSettings(uri=f"sqlite:///{tmp_path / 'mlflow.db'}", experiment="tests")
    (tmp_path / "out").mkdir()
    tracked = begin(ComparisonFolder(tmp_path / "out"), open_tracker(store), "compare", {})
    (tmp_path / "mlflow.db").unlink()
    (tmp_path / "mlflow.db").mkdir()
    for seed in (1000, 1001):
        tracked.try_child(RunKey("random", seed), [trial(0)])
    with pytest.raises(UserError, match="cannot be used"):
        tracked.child(RunKey("random", 1000), [trial(0)])
    assert capsys.readouterr().err.count("The comparison goes on") == 1
