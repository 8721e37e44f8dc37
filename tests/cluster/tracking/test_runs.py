"""Runs in a real MLflow store: everything given is there, and they end as their blocks end."""

import shlex
import sys
from pathlib import Path

import pytest
from mlflow import MlflowClient

from cluster.config import TrackingSettings
from cluster.errors import UserError
from cluster.settings import load_settings
from cluster.tracking import open_tracker
from cluster.tracking.origin import DESCRIPTIONS, command_line, origin
from cluster.tracking.runs import Run, Tracker, unusable


def record(tracker, run):
    return tracker.client.get_run(run.id)


def test_a_run_keeps_its_name_kind_and_nested_parameters(tracker):
    with tracker.run("short", "collect", {"seed": 0, "train": {"stride": 5}}, {"note": "dry"}) as run:
        pass
    kept = record(tracker, run)
    assert kept.info.run_name == "short"
    assert kept.data.tags["svaedc.kind"] == "collect"
    assert kept.data.tags["note"] == "dry"
    assert kept.data.params == {"seed": "0", "train.stride": "5"}


def test_a_run_says_which_command_made_it_and_what_that_does(tracker, monkeypatch):
    monkeypatch.setattr(
        sys, "argv", ["/usr/bin/svaedc", "collect", "--setup", "franka", "--dataset", "my data"]
    )
    with tracker.run("named", "collect", {}) as run, run.child("part", {}) as child:
        pass
    tags = record(tracker, run).data.tags
    assert tags["mlflow.source.name"] == "svaedc collect --setup franka --dataset 'my data'"
    assert tags["mlflow.source.type"] == "LOCAL"
    first, command, where = tags["mlflow.note.content"].split("\n\n")
    assert first == "Simulated episodes of random controllers, collected into a dataset."
    assert command == f"    {tags['mlflow.source.name']}"
    assert str(Path.cwd()) in where
    assert "the run above this one" in record(tracker, child).data.tags["mlflow.note.content"]


@pytest.mark.parametrize("kind", ["collect", "plan", "train", "sweep", "compare", "hardware", "child"])
def test_every_kind_of_run_is_described(kind):
    assert origin(kind)["mlflow.note.content"].startswith(DESCRIPTIONS[kind])


def test_no_password_is_recorded(monkeypatch):
    uri = "tracking.uri=https://me:secret@tracker:5000/x"
    monkeypatch.setattr(sys, "argv", ["svaedc", "train", "--set", uri, "--model", "a:b@c"])
    assert command_line() == "svaedc train --set tracking.uri=https://me:***@tracker:5000/x --model a:b@c"


def test_file_names_that_are_no_text_here_are_recorded_as_utf_8(tracker):
    """As `LC_ALL=C` makes them."""
    with tracker.run("undecoded", "collect", {"folder": "Gr\udcc3\udcb6\udcc3\udc9fe"}) as run:
        run.tags({"note": "\udcff"})
    kept = record(tracker, run).data
    assert kept.params == {"folder": "Größe"}
    assert kept.tags["note"] == "\ufffd"


def test_a_link_into_a_file_is_followed_by_the_command_that_shows_it(tmp_path, monkeypatch):
    (tmp_path / "here it's").mkdir()
    monkeypatch.chdir(tmp_path / "here it's")
    run = Run(open_tracker(TrackingSettings()), "123")
    assert run.link == f"{run.url} (`svaedc ui` shows it)"
    monkeypatch.chdir(tmp_path)
    _, command, _ = run.link.split("`")
    *start, option, setting = shlex.split(command)
    assert (start, option) == (["svaedc", "ui"], "--set")
    assert load_settings(None, [setting]).tracking.file == tmp_path / "here it's" / "mlflow.db"


def test_a_link_to_a_server_stands_alone():
    tracker = Tracker(MlflowClient("https://tracker:5000"), "https://tracker:5000", experiment="7")
    assert Run(tracker, "123").link == "https://tracker:5000/#/experiments/7/runs/123"


def test_metrics_keep_their_steps_and_undefined_ones_are_left_out(tracker):
    with tracker.run("steps", "train", {}) as run:
        run.metrics({"loss": 3.0, "ratio": float("nan")}, step=0)
        run.metrics({"loss": 2.0}, step=1)
    history = tracker.client.get_metric_history(run.id, "loss")
    assert [(point.step, point.value) for point in history] == [(0, 3.0), (1, 2.0)]
    assert "ratio" not in record(tracker, run).data.metrics


def test_a_curve_longer_than_one_request_arrives_whole(tracker):
    curve = [float(value) for value in range(1005)]
    with tracker.run("curve", "compare", {}) as run:
        run.curves({"best": curve})
    history = tracker.client.get_metric_history(run.id, "best")
    assert sorted((point.step, point.value) for point in history) == list(enumerate(curve))


def test_more_parameters_than_one_request_arrive_whole(tracker):
    parameters = {f"p{index}": index for index in range(150)}
    with tracker.run("many", "train", parameters) as run:
        pass
    assert len(record(tracker, run).data.params) == 150


def test_child_runs_name_their_parent(tracker):
    with (
        tracker.run("parent", "compare", {}) as parent,
        parent.child("svae-dc 0", {"method": "svae-dc"}) as child,
    ):
        pass
    assert record(tracker, child).data.tags["mlflow.parentRunId"] == parent.id


def test_figures_files_and_summaries_are_kept(tracker, tmp_path):
    (tmp_path / "figure.svg").write_text("<svg/>")
    (tmp_path / "notes.txt").write_text("notes")
    with tracker.run("figures", "compare", {}) as run:
        run.figure(tmp_path / "figure.svg")
        run.file(tmp_path / "notes.txt")
        run.dict("summary", {"best": 1.5})
    folder = Path(tracker.client.download_artifacts(run.id, "", str(tmp_path)))
    assert (folder / "figures" / "figure.svg").read_text() == "<svg/>"
    assert (folder / "notes.txt").read_text() == "notes"
    assert '"best": 1.5' in (folder / "summary.json").read_text()


def test_the_datasets_fingerprint_is_the_runs_input(tracker, tmp_path):
    fingerprint = "0123456789abcdef" * 4
    with tracker.run("input", "train", {}) as run:
        run.dataset("franka", fingerprint, tmp_path)
    kept = record(tracker, run)
    (used,) = kept.inputs.dataset_inputs
    assert (used.dataset.name, used.dataset.digest) == ("franka", fingerprint[:36])
    assert kept.data.tags["svaedc.dataset"] == fingerprint


@pytest.mark.parametrize(
    ("error", "status"), [(ValueError, "FAILED"), (KeyboardInterrupt, "KILLED"), (SystemExit, "KILLED")]
)
def test_a_run_ends_as_its_block_ended(tracker, error, status):
    with pytest.raises(error), tracker.run("ends", "train", {}) as run:
        raise error
    assert record(tracker, run).info.status == status


def test_a_resumed_run_is_the_same_run_and_ends_anew(tracker):
    with pytest.raises(KeyboardInterrupt), tracker.run("resumed", "train", {"seed": 1}) as run:
        raise KeyboardInterrupt
    with tracker.resume(run.id) as again:
        assert record(tracker, again).info.status == "RUNNING"
        again.metrics({"loss": 1.0}, step=7)
    kept = record(tracker, run)
    assert (kept.info.status, kept.data.params, kept.data.metrics) == (
        "FINISHED",
        {"seed": "1"},
        {"loss": 1.0},
    )


def test_resuming_an_unknown_run_is_refused(tracker):
    with pytest.raises(UserError, match="no-such-run"):
        tracker.resume("no-such-run")


def test_a_store_that_fails_at_the_end_does_not_hide_the_blocks_error(tmp_path):
    tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{tmp_path}/mlflow.db"))
    run = tracker.run("ends", "train", {})
    tracker.client._tracking_client.store.engine.dispose()
    (tmp_path / "mlflow.db").write_bytes(b"spoilt" * 1000)
    with pytest.raises(ValueError, match="the real reason") as raised, run:
        raise ValueError("the real reason")
    assert any("cannot be used" in note for note in raised.value.__notes__)


def test_a_store_that_fails_is_told_by_the_first_line_of_its_reason_and_the_remedy():
    told = str(unusable("sqlite:///runs.db", OSError("disk I/O error\n(Background on this error at: ...)")))
    assert told.startswith("the MLflow store sqlite:///runs.db cannot be used: disk I/O error; make it")
    assert "Background" not in told
    assert "TimeoutError;" in str(unusable("sqlite:///runs.db", TimeoutError()))
