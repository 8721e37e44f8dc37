"""`svaedc compare` on a real cluster: shared beginnings, resumed trial by trial, refused if it does not fit."""

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import torch

from cluster.compare import Grid, compare
from cluster.config import CompareSettings
from cluster.errors import UsageError, UserError
from cluster.results import RunKey, recorded
from cluster.tracking import open_tracker
from svaedc import checkpoint
from svaedc.model import SvaeDc
from svaedc.presets import Sizes, compact
from workers import setups

SETTINGS = CompareSettings(slots=2, pool_size=200)


def untrained(folder: Path, setup: str = "franka") -> Path:
    """A checkpoint whose predictions mean nothing; enough to test the machine around it."""
    torch.manual_seed(0)
    model = SvaeDc(compact(Sizes(48, 25, 100)).model)
    folder.mkdir()
    checkpoint.save(folder / "model.pt", model, {"setup": setup})
    return folder


@pytest.fixture
def compared(ray_session, tracking_settings, tmp_path):
    """Runs a small comparison into a folder of the test's own."""

    def run(
        methods: str = "random,se",
        model: Path | None = None,
        gap: str = "paper",
        settings: CompareSettings = SETTINGS,
        runs: int = 2,
    ) -> Path:
        compare(
            setup=setups.load("franka"),
            grid=Grid(tuple(methods.split(",")), seed=1000, runs=runs),
            trials=2,
            gap=gap,
            model=model,
            folder=tmp_path / "out",
            settings=settings,
            session=ray_session,
            tracker=open_tracker(tracking_settings),
        )
        return tmp_path / "out"

    return run


def table(folder: Path) -> list[dict]:
    return pq.read_table(folder / "trials.parquet").drop(["seconds"]).to_pylist()


def test_a_comparison_writes_a_table_a_summary_and_figures(compared, tmp_path, tracking_settings):
    out = compared("random,screened-random,svae-dc", model=untrained(tmp_path / "model"))
    rows = table(out)
    assert len(rows) == 3 * 2 * 4
    assert [*rows[0]] == [
        *("setup", "gap", "method", "run", "trial", "f", "y", "best", "success", "status", "stop", "x"),
    ]
    for run in (1000, 1001):
        first = [row for row in rows if row["run"] == run and row["trial"] < 2]
        for trial in (0, 1):
            same = [(row["x"], row["f"]) for row in first if row["trial"] == trial]
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
    client = open_tracker(tracking_settings).client
    runs = client.search_runs(["1"])
    [parent] = [run for run in runs if "mlflow.parentRunId" not in run.data.tags]
    children = [run for run in runs if run.data.tags.get("mlflow.parentRunId") == parent.info.run_id]
    assert len(children) == 6
    assert len(client.get_metric_history(children[0].info.run_id, "best")) == 4


def test_an_interrupted_comparison_goes_on_trial_by_trial_to_the_same_table(compared):
    whole = table(compared())
    out = compared()
    path = RunKey("se", 1001).path(out)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:3]) + lines[3][:40])
    RunKey("random", 1000).path(out).unlink()
    assert len(recorded(path)) == 3
    assert table(compared()) == whole


def test_more_runs_and_methods_extend_a_comparison(compared):
    before = table(compared("random", runs=1))
    after = table(compared("random,se", runs=2))
    assert [row for row in after if row["method"] == "random" and row["run"] == 1000] == before
    assert len(after) == 16


def test_the_hidden_physics_differ_between_runs_and_between_gaps(compared):
    rows = table(compared("random"))
    one, other = (np.array([row["f"] for row in rows if row["run"] == run]) for run in (1000, 1001))
    assert not np.array_equal(one, other)


def test_unknown_names_are_refused_with_the_nearest(compared):
    with pytest.raises(UsageError, match="did you mean 'svae-dc'"):
        compared("svae-cd")
    with pytest.raises(UsageError, match="did you mean 'paper'"):
        compared(gap="papre")


def test_a_method_without_its_model_is_refused(compared):
    with pytest.raises(UsageError, match="svae-dc need a trained model: name its folder with --model"):
        compared("random,svae-dc")


def test_a_model_of_another_setup_or_a_damaged_one_is_refused(compared, tmp_path):
    with pytest.raises(UserError, match="made for setup 'yumi', not 'franka'"):
        compared("svae", model=untrained(tmp_path / "other", setup="yumi"))
    (tmp_path / "other" / "model.pt").write_bytes(b"no")
    with pytest.raises(UserError, match="damaged"):
        compared("svae", model=tmp_path / "other")
    with pytest.raises(UserError, match="cannot use the model"):
        compared("svae", model=tmp_path / "nowhere")


def test_another_comparison_in_the_folder_is_refused_naming_the_difference(compared):
    compared("random", runs=1)
    with pytest.raises(UserError, match="holds a comparison with pool_size 200, not 300"):
        compared("random", settings=CompareSettings(slots=2, pool_size=300))


def test_more_slots_than_cpus_are_refused(compared):
    with pytest.raises(UserError, match="needs 7 CPUs"):
        compared("random", settings=CompareSettings(slots=7, pool_size=200))
