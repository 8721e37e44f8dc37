"""Runs in a real MLflow store, and the store's real pages in a real browser."""

import shutil
import signal
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from cluster.config import TrackingSettings
from cluster.errors import UserError
from cluster.tracking import open_tracker
from cluster.tracking.server import serve_ui

REPOSITORY = Path(__file__).parents[3]


@pytest.fixture(scope="module")
def settings(tmp_path_factory):
    folder = tmp_path_factory.mktemp("tracking")
    return TrackingSettings(uri=f"sqlite:///{folder}/store/mlflow.db", experiment="tests")


@pytest.fixture(scope="module")
def tracker(settings):
    return open_tracker(settings)


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


def test_a_deleted_experiment_is_named_with_the_remedy(settings, tracker):
    gone = settings.model_copy(update={"experiment": "gone"})
    tracker.client.delete_experiment(open_tracker(gone).experiment)
    with pytest.raises(UserError, match=r"'gone' was deleted.*tracking\.experiment"):
        open_tracker(gone)


def test_a_store_below_a_file_is_refused_with_its_address_and_the_remedy(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match=r"sqlite:////.*file/mlflow\.db cannot be used.*tracking\.uri"):
        open_tracker(TrackingSettings(uri=f"sqlite:///{tmp_path}/file/mlflow.db"))


def test_a_file_that_is_no_database_is_refused_and_left_alone(tmp_path):
    database = tmp_path / "mlflow.db"
    database.write_text("the only copy of something else" * 100)
    with pytest.raises(UserError, match="cannot be used"):
        open_tracker(TrackingSettings(uri=f"sqlite:///{database}"))
    assert database.read_text().startswith("the only copy")


def test_a_server_that_does_not_answer_is_refused(free_port):
    with pytest.raises(UserError, match=rf"127\.0\.0\.1:{free_port} cannot be used: .*refused"):
        open_tracker(TrackingSettings(uri=f"http://127.0.0.1:{free_port}"))


def test_a_store_that_fails_at_the_end_does_not_hide_the_blocks_error(tmp_path):
    tracker = open_tracker(TrackingSettings(uri=f"sqlite:///{tmp_path}/mlflow.db"))
    run = tracker.run("ends", "train", {})
    tracker.client._tracking_client.store.engine.dispose()
    (tmp_path / "mlflow.db").write_bytes(b"spoilt" * 1000)
    with pytest.raises(ValueError, match="the real reason") as raised, run:
        raise ValueError("the real reason")
    assert any("cannot be used" in note for note in raised.value.__notes__)


def test_commands_that_create_a_store_at_once_share_one_experiment(tmp_path):
    program = (
        "from cluster.config import TrackingSettings; from cluster.tracking import open_tracker;"
        f"print(open_tracker(TrackingSettings(uri='sqlite:///{tmp_path}/mlflow.db')).experiment)"
    )
    command = [sys.executable, "-c", program]
    with ThreadPoolExecutor(2) as pool:
        starts = [pool.submit(subprocess.check_output, command, cwd=REPOSITORY, text=True) for _ in range(2)]
    first, second = (start.result() for start in starts)
    assert first == second


@pytest.mark.slow
def test_a_store_whose_making_was_killed_is_made_anew(tmp_path):
    """Killed again and again, each time a little later, until one making comes to its end."""
    code = (
        "import sys; from cluster.config import TrackingSettings; from cluster.tracking import open_tracker; "
    )
    code += "open_tracker(TrackingSettings(uri=sys.argv[1]))"
    uri, kills, seconds = f"sqlite:///{tmp_path}/mlflow.db", 0, 0.0
    while True:
        making = subprocess.Popen([sys.executable, "-c", code, uri], cwd=REPOSITORY)
        while making.poll() is None and not list(tmp_path.glob("*.db")):
            time.sleep(0.01)
        try:
            assert making.wait(seconds) == 0
            break
        except subprocess.TimeoutExpired:
            making.kill()
            making.wait()
            kills, seconds = kills + 1, seconds + 0.3
    assert kills > 2
    tracker = open_tracker(TrackingSettings(uri=uri))
    assert [path.name for path in tmp_path.glob("*.db")] == ["mlflow.db"]
    with tracker.run("after all", "collect", {}) as run:
        pass
    assert record(tracker, run).info.run_name == "after all"


@pytest.fixture
def served(settings, tracker, free_port):
    """`svaedc ui` in a process of its own, with one run to show: the process and its page."""
    with tracker.run("franka push of the browser test", "compare", {}):
        pass
    program = (
        "import sys; from cluster.config import TrackingSettings;"
        "from cluster.tracking.server import serve_ui;"
        f"serve_ui(TrackingSettings(uri={settings.uri!r}, experiment='tests'), {free_port},"
        " lambda page: print(page, flush=True))"
    )
    process = subprocess.Popen(
        [sys.executable, "-c", program],
        cwd=REPOSITORY,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )
    yield process, process.stdout.readline().strip()
    process.kill()
    process.wait()
    process.stdout.close()


def answers(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def browse(page: str, profile: Path) -> str:
    """What a browser shows of a page, once its scripts had time to run."""
    chromium = shutil.which("chromium")
    if chromium is None:
        pytest.skip("no chromium on PATH; `.ci/run` installs it")
    command = [chromium, "--headless", "--no-sandbox", "--disable-gpu", "--disable-quic"]
    command += ["--no-first-run", "--disable-background-networking", "--disable-component-update"]
    command += ["--disable-sync", "--disable-dev-shm-usage", f"--user-data-dir={profile}"]
    command += ["--window-size=1400,900", "--virtual-time-budget=30000", "--dump-dom", page]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=240).stdout


def test_the_served_page_lists_the_run_and_an_interrupt_ends_the_server(served, free_port, tmp_path):
    process, page = served
    assert page.startswith(f"http://127.0.0.1:{free_port}/#/experiments/")
    assert "franka push of the browser test" in browse(page, tmp_path / "profile")
    process.send_signal(signal.SIGINT)
    process.wait(timeout=180)
    assert not answers(free_port)


def test_the_server_ends_when_its_command_is_killed_outright(served, free_port):
    process, _ = served
    assert answers(free_port)
    process.kill()
    process.wait()
    deadline = time.monotonic() + 120
    while answers(free_port) and time.monotonic() < deadline:
        time.sleep(0.1)
    assert not answers(free_port)


def test_a_taken_port_is_named(settings):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(UserError, match=rf"port {port} cannot be served.*--port {port + 1}"):
            serve_ui(settings, port, print)
