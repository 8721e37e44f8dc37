"""`svaedc compare` on a real cluster: shared beginnings, resumed trial by trial, refused if it misfits."""

import json
import os
import shutil
import signal
import sqlite3
import subprocess
import sys
import time
from base64 import b64encode
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
import torch
from matplotlib.markers import MarkerStyle

from cluster.comparison import figure
from cluster.comparison.compare import compare
from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.plan import Grid, plan_comparison, usable
from cluster.comparison.records import RunKey, append, read_trials
from cluster.comparison.tracking import begin
from cluster.comparison.tune import BestSoFar
from cluster.comparison.worker import evaluation
from cluster.config import CompareSettings, TrackingSettings
from cluster.errors import UsageError, UserError
from cluster.tracking import open_tracker
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Row
from svaedc.bo.loop import Trial
from svaedc.bo.methods import names
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.presets import Sizes, compact, vary
from workers import setups

SETTINGS = CompareSettings(slots=2, pool_size=200)


def untrained(folder: Path, setup: str = "franka", seed: int = 0) -> Path:
    """A checkpoint whose predictions mean nothing; enough to test the machine around it."""
    torch.manual_seed(seed)
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
        trials: int = 2,
        folder: Path = tmp_path / "out",
        tracking: TrackingSettings = tracking_settings,
    ) -> Path:
        plan = plan_comparison(
            setup=setups.load("franka"),
            grid=Grid(tuple(methods.split(",")), seed=1000, runs=runs),
            trials=trials,
            gap=gap,
            model=model,
            folder=folder,
            settings=settings,
        )
        compare(plan, ray_session, open_tracker(tracking))
        return folder

    return run


def table(folder: Path) -> list[dict]:
    return pq.read_table(folder / "trials.parquet").drop(["seconds"]).to_pylist()


def mlflow_runs(tracking_settings) -> tuple[list, list]:
    """Parent runs and child runs, the newest first."""
    runs = open_tracker(tracking_settings).client.search_runs(["1"])
    parents = [run for run in runs if "mlflow.parentRunId" not in run.data.tags]
    return parents, [run for run in runs if "mlflow.parentRunId" in run.data.tags]


def trial(index: int, seconds: float = 0.1) -> Trial:
    return Trial(index, np.zeros(48, dtype=np.float32), 0.5, 0.1, 0.5, True, "ok", seconds, "")


def test_a_comparison_writes_a_table_a_summary_and_figures(compared, tmp_path, tracking_settings):
    out = compared("random,screened-random,svae-dc", model=untrained(tmp_path / "model"))
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


def test_an_interrupted_comparison_goes_on_trial_by_trial_to_the_same_table(compared):
    whole = table(compared())
    out = compared()
    path = RunKey("se", 1001).path(out)
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(b"".join(lines[:3]) + lines[3][:40])
    RunKey("random", 1000).path(out).unlink()
    assert len(read_trials(path)) == 3
    assert table(compared()) == whole


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


def command(folder: Path) -> list[str]:
    return [
        *(sys.executable, "-m", "cluster", "compare", "--setup", "franka", "--out", str(folder / "out")),
        *("--methods", "random,se", "--runs", "2", "--trials", "8", "--seed", "1000"),
        *("--set", "compare.pool_size=200", "--set", "ray.num_cpus=2"),
        *("--set", f"tracking.uri=sqlite:///{folder / 'store' / 'mlflow.db'}"),
        *("--set", "tracking.experiment=tests"),
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "code"), [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGKILL, -signal.SIGKILL)]
)
def test_a_comparison_stopped_by_a_signal_goes_on_to_the_same_table(
    number, code, compared, tmp_path, tracking_settings
):
    with subprocess.Popen(
        command(tmp_path), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    ) as process:
        deadline = time.monotonic() + 300
        while not any(path.stat().st_size for path in tmp_path.glob("out/runs/*.jsonl")):
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        if number == signal.SIGINT:  # a terminal sends it to the whole group
            os.killpg(process.pid, number)
        else:
            process.send_signal(number)
        output, _ = process.communicate(timeout=180)
    assert process.returncode == code, output
    if number != signal.SIGKILL:
        assert output.splitlines() == [
            "stopped: everything finished is kept, and the same command goes on from here"
        ]
    assert not (tmp_path / "out" / "trials.parquet").exists()
    after = table(compared(trials=8))
    [parent], children = mlflow_runs(tracking_settings)
    assert [run.info.status for run in (parent, *children)] == ["FINISHED"] * 5
    assert after == table(compared(trials=8, folder=tmp_path / "whole"))


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


@pytest.mark.parametrize("damage", ["no", "[]", "{}", '{"setup": "franka"}', "\x00"])
def test_a_damaged_identity_is_refused_naming_its_file(compared, tmp_path, damage):
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "comparison.json").write_text(damage)
    with pytest.raises(UserError, match=r"comparison.json is damaged: .* put the file back"):
        compared("random")
    assert (tmp_path / "out" / "comparison.json").read_text() == damage


def test_runs_without_their_identity_are_refused(compared, tmp_path):
    (tmp_path / "out" / "runs").mkdir(parents=True)
    append(RunKey("random", 1000).path(tmp_path / "out"), trial(0))
    with pytest.raises(UserError, match=r"comparison\.json is gone, though there are runs"):
        compared("random")


def test_two_comparisons_at_once_in_one_folder_are_refused(compared, tmp_path):
    with (
        ComparisonFolder(tmp_path / "out").alone(),
        pytest.raises(UserError, match=r"another comparison is at work in .*/out; wait for its end"),
    ):
        compared("random")
    assert len(table(compared("random", runs=1))) == 4


def test_the_hidden_physics_belong_to_the_run_and_to_the_gap():
    setup = setups.load("franka")
    x = np.random.default_rng(0).random(setup.dimensions, dtype=np.float32)
    with setup.open() as environment:

        def f(gap: str, run: int) -> float:
            return evaluation(setup, environment, gap, run)(x).f

        gaps = ("object1_mass=1.9:2.1", "paper", "training", "wide")
        found = [f(gap, run) for gap in gaps for run in (1000, 1001)]
        assert len(set(found)) == 8
        assert f("wide", 1001) == found[-1]


def test_a_comparison_runs_under_the_gap_it_was_asked_for(compared, tmp_path):
    paper, wide = (table(compared("random", gap=gap, folder=tmp_path / gap)) for gap in ("paper", "wide"))
    assert [row["x"] for row in paper] == [row["x"] for row in wide]
    assert all(one["f"] != other["f"] for one, other in zip(paper, wide, strict=True))


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
    compared("random", model=other, runs=1)
    compared("random,svae", model=one, runs=1)
    compared("se", model=other, runs=1)
    out = compared("matern", runs=1)
    assert {row["method"] for row in table(out)} == {"random", "svae", "se", "matern"}
    with pytest.raises(UserError, match=r"holds a comparison with model '\w+', not '\w+'"):
        compared("svae-dc", model=other, runs=1)


def test_unknown_names_are_refused_with_the_nearest(compared):
    with pytest.raises(UsageError, match="did you mean 'svae-dc'"):
        compared("svae-cd")
    with pytest.raises(UsageError, match="did you mean 'paper'"):
        compared(gap="papre")
    with pytest.raises(UsageError, match="did you mean 'object1_mass'"):
        compared(gap="object1_mas=2")
    with pytest.raises(UsageError, match=r"object1_mass must satisfy 0 <= low <= high, got \[3.0, 2.0\]"):
        compared(gap="object1_mass=3:2")


@pytest.mark.parametrize(
    ("methods", "message"),
    [((), "at least one of bbk-kl, .*, got none"), (("se", "se"), "once, got se, se")],
)
def test_a_grid_names_every_method_once_and_at_least_one(methods, message):
    with pytest.raises(UsageError, match=message):
        Grid(methods, seed=0, runs=1)


def test_runs_for_tuning_and_runs_for_reporting_share_no_folder(compared, tmp_path):
    (tmp_path / "out" / "runs").mkdir(parents=True)
    append(RunKey("random", 3).path(tmp_path / "out"), trial(0))
    with pytest.raises(UserError, match=r"another purpose; choose another folder with --out: .* 3 to 1001"):
        compared("random")
    with pytest.raises(UsageError, match=r"--seed and --runs: .* got 999 to 1000"):
        Grid(("random",), seed=999, runs=2)


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


def planned_with(**changes):
    usual = {
        "setup": setups.load("franka"),
        "grid": Grid(("random", "svae-dc"), seed=1000, runs=1),
        "trials": 5,
        "gap": "paper",
        "settings": SETTINGS,
    }
    return plan_comparison(**{**usual, **changes})


def test_a_model_without_badness_is_refused_for_methods_that_compress_before_anything_runs(tmp_path):
    torch.manual_seed(0)
    model = SvaeDc(vary(compact(Sizes(48, 25, 100)), {"model": "svae"}).model)
    (tmp_path / "svae").mkdir()
    checkpoint.save(tmp_path / "svae" / "model.pt", model, {"setup": "franka"})
    with pytest.raises(UserError, match="'svae-dc': the model must predict badness, got an SVAE"):
        planned_with(model=tmp_path / "svae", folder=tmp_path / "out")
    planned_with(grid=Grid(("svae",), 1000, 1), model=tmp_path / "svae", folder=tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_a_pool_with_fewer_controllers_than_trials_is_refused_naming_the_setting(tmp_path):
    few, grid = CompareSettings(pool_size=15), Grid(("screened-random",), 1000, 1)
    model = untrained(tmp_path / "model")
    with pytest.raises(
        UserError, match=r"compare\.pool_size is 15.*may choose from 5 of 15 .* fewer than its 6 trials"
    ):
        planned_with(grid=grid, trials=6, model=model, settings=few, folder=tmp_path / "out")


def test_runs_of_a_setup_whose_code_has_changed_are_not_mixed(tmp_path):
    setup = replace(setups.load("franka"), code="1" * 64)
    plans = [
        planned_with(grid=Grid(("random",), 1000, 1), setup=each, model=None, folder=tmp_path)
        for each in (setup, replace(setup, code="2" * 64))
    ]
    (tmp_path / "runs").mkdir()
    ComparisonFolder(tmp_path).claim(plans[0].identity, "")
    ComparisonFolder(tmp_path).claim(plans[0].identity, "")
    with pytest.raises(UserError, match=r"with setup_digest '1111.*, not '2222"):
        ComparisonFolder(tmp_path).claim(plans[1].identity, "")


def test_a_stand_in_takes_the_model_of_what_it_stands_in_for_and_no_other(tmp_path):
    on_franka, on_yumi = (untrained(tmp_path / name, setup=name) for name in ("franka", "yumi"))
    assert usable(on_franka, setups.load("franka-rehearsal"))[1] == "franka"
    assert usable(on_franka, setups.load("franka"))[1] == "franka"
    own = untrained(tmp_path / "own", setup="franka-rehearsal")
    assert usable(own, setups.load("franka-rehearsal"))[1] == "franka-rehearsal"
    with pytest.raises(UserError, match="made for setup 'yumi', not 'franka-rehearsal'"):
        usable(on_yumi, setups.load("franka-rehearsal"))
    with pytest.raises(UserError, match="made for setup 'franka-rehearsal', not 'franka'"):
        usable(own, setups.load("franka"))


def test_another_comparison_in_the_folder_is_refused_naming_the_difference(compared):
    compared("random", runs=1)
    with pytest.raises(UserError, match="holds a comparison with pool_size 200, not 300"):
        compared("random", settings=CompareSettings(slots=2, pool_size=300))


def test_more_slots_than_cpus_are_refused(compared):
    with pytest.raises(UserError, match="needs 7 CPUs"):
        compared("random", settings=CompareSettings(slots=7, pool_size=200))


def test_a_folder_that_cannot_be_written_is_refused_naming_it(compared, tmp_path):
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(UserError, match=r"cannot write to .*/file/out: .*Not a directory.*--out"):
        compared("random", folder=tmp_path / "file" / "out")


@pytest.fixture
def disk_with_room_for(tmp_path):
    """Mounts a small file system; the number of bytes is its size."""
    small = tmp_path / "small"
    small.mkdir()

    def mount(size: str) -> Path:
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(small)], check=True)
        return small

    yield mount
    subprocess.run(["umount", "--lazy", str(small)], check=True)


@pytest.mark.slow
@pytest.mark.skipif(os.getuid() != 0, reason="only root may mount a small file system")
def test_a_full_disk_ends_a_comparison_with_nothing_lost(compared, disk_with_room_for, tmp_path):
    small = disk_with_room_for("40k")
    with pytest.raises(UserError, match=r"cannot write to .*No space left on device; make room"):
        compared("random", trials=20, folder=small / "out")
    kept = [found for path in small.glob("out/runs/*") for found in read_trials(path)]
    assert kept
    shutil.copytree(small / "out", tmp_path / "roomy")
    assert table(compared("random", trials=20, folder=tmp_path / "roomy")) == table(
        compared("random", trials=20, folder=tmp_path / "whole")
    )


@pytest.mark.skipif(os.getuid() != 0, reason="only root may mount a small file system")
def test_a_disk_too_full_for_the_figure_keeps_the_trials(compared, disk_with_room_for):
    small = disk_with_room_for("64k")
    with pytest.raises(UserError, match=r"cannot write to .*No space left on device; make room"):
        compared("random", runs=1, folder=small / "out")
    assert len(read_trials(RunKey("random", 1000).path(small / "out"))) == 4
    assert not list(small.glob("out/.unfinished*"))
    subprocess.run(["mount", "-o", "remount,size=2m", str(small)], check=True)
    assert len(table(compared("random", runs=1, folder=small / "out"))) == 4
    assert (small / "out" / "figure.svg").exists()


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


def test_runs_that_would_vanish_beside_longer_ones_are_refused(compared, capsys):
    out = compared("random", runs=1)
    whole = table(out)
    with pytest.raises(UserError, match=r"holds runs of 2 suggested trials.*ask for --trials 2"):
        compared("se", runs=1, trials=1)
    assert table(out) == whole
    capsys.readouterr()
    compared("se", runs=1, trials=3)
    assert "runs of random in" in capsys.readouterr().err


def test_a_copy_among_the_records_is_no_run(tmp_path):
    (tmp_path / "runs").mkdir()
    append(RunKey("svae-dc", 3).path(tmp_path), trial(0))
    shutil.copy(RunKey("svae-dc", 3).path(tmp_path), tmp_path / "runs" / "svae-dc-00003 (copy).jsonl")
    assert ComparisonFolder(tmp_path).begun_keys() == [RunKey("svae-dc", 3)]


@pytest.mark.slow
def test_runs_that_keep_failing_are_named_with_their_errors_and_cost_no_other_run(compared, capfd):
    out = compared("random", runs=1, trials=5)
    append(RunKey("se", 1000).path(out), trial(0))  # of another controller than the runs of this seed share
    capfd.readouterr()
    with pytest.raises(UserError, match=r"1 of 2 runs kept failing.*ValueError: trial 0 must have tried"):
        compared("se,matern", runs=1, trials=5)
    errors = (out / "errors.txt").read_text()
    assert "comparison.py" in errors
    assert {sign for sign in errors if not sign.isprintable()} == {"\n"}
    assert len(read_trials(RunKey("matern", 1000).path(out))) == 7
    assert len(read_trials(RunKey("se", 1000).path(out))) == 1
    said = capfd.readouterr()
    assert said.out == ""
    lines = [line for line in said.err.splitlines() if "best so far" not in line]
    assert lines == ["run se 1000 failed and is tried again from its last trial"] * 2


def test_the_standing_shows_every_method_in_the_order_asked_for():
    standing = BestSoFar(("se", "random"), {RunKey("random", 0): 0.25, RunKey("random", 1): 0.75})
    assert str(standing) == "random 0.50"
    standing.best[RunKey("se", 0)] = 0.125
    assert str(standing) == "se 0.12, random 0.50"
    standing.best[RunKey("se", 1)] = float("nan")
    assert str(standing) == "se 0.12, random 0.50"


def test_the_figure_has_the_same_bytes_every_time_and_names_every_method(tmp_path):
    rng = np.random.default_rng(0)
    rows = [
        Row(name, run, index, float(rng.uniform(-1, 1)), success=False)
        for name, run, index in ((n, r, t) for n in names() for r in range(3) for t in range(5))
    ]
    summary = summarize([*rows, Row("unfinished", 0, 0, 0.0, success=False)], Reporting(), rng)
    drawn = [
        figure.best_so_far(tmp_path / name, summary, title="some title", initial=2, limits=(-1.0, 1.0))
        for name in ("one.png", "other.png")
    ]
    for one, other in zip(*drawn, strict=True):
        assert one.read_bytes() == other.read_bytes()
    svg = drawn[0][1].read_text()
    assert all(f"<!-- {name} (n = 3) -->" in svg for name in names())
    assert "unfinished (n" not in svg


def test_every_method_has_a_marker_of_its_own_that_shows_without_an_edge():
    markers = [figure.STYLES[name][1] for name in figure.STYLES]
    assert all(MarkerStyle(marker).is_filled() for marker in markers)
    assert len(set(markers)) == len(markers)
