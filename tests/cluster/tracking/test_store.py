"""Stores of MLflow: made once, and named with the remedy where they cannot be used."""

import os
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from cluster.config import TrackingSettings
from cluster.errors import UserError
from cluster.settings import load_settings
from cluster.tracking.store import open_tracker

REPOSITORY = Path(__file__).parents[3]


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


NAMES = ["what? #1 50%20x", "Größe, two words", 'Bob\'s "best" :10', "a;b&c=d@e[x]\\y"]


@pytest.mark.parametrize(
    ("name", "way"), [(NAMES[0], "in the setting"), *((name, "of the working directory") for name in NAMES)]
)
def test_a_store_lies_in_its_folder_whatever_the_name_and_is_read_back(tmp_path, monkeypatch, name, way):
    folder = tmp_path / name
    folder.mkdir()
    (tmp_path / "notes.txt").write_text("notes", encoding="utf-8")
    monkeypatch.chdir(folder if way.startswith("of") else tmp_path)
    settings = load_settings(
        None, [] if way.startswith("of") else [f"tracking.uri=sqlite:///{folder}/mlflow.db"]
    )
    with open_tracker(settings.tracking).run("kept", "collect", {"folder": folder}) as run:
        run.file(tmp_path / "notes.txt")
    assert sorted(path.name for path in folder.iterdir()) == ["mlflow.db", "mlruns"]
    assert {path.name for path in tmp_path.iterdir()} == {name, "notes.txt"}
    again = open_tracker(settings.tracking)
    assert again.client.get_run(run.id).data.params == {"folder": str(folder)}
    monkeypatch.chdir(tmp_path)
    read = Path(again.client.download_artifacts(run.id, "notes.txt"))
    kept = folder / "mlruns" / run.id / "artifacts" / "notes.txt"
    assert read.read_text(encoding="utf-8") == kept.read_text(encoding="utf-8") == "notes"


def test_the_address_that_is_shown_names_the_same_store(tmp_path):
    shown = open_tracker(load_settings(None, [f"tracking.uri=sqlite:///{tmp_path}/50% #1?.db"]).tracking)
    assert shown.uri == f"sqlite:///{tmp_path}/50% #1?.db"
    with shown.run("found again", "collect", {}) as run:
        pass
    assert open_tracker(load_settings(None, [f"tracking.uri={shown.uri}"]).tracking).holds(run.id)


def test_a_folder_that_the_systems_encoding_cannot_name_is_refused_with_the_remedy(tmp_path, monkeypatch):
    folder = tmp_path / os.fsdecode(b"Gr\xf6\xdfe")
    folder.mkdir()
    monkeypatch.chdir(folder)
    with pytest.raises(UserError, match=r"cannot be used: .*; set LC_ALL=C\.UTF-8, or name another"):
        open_tracker(TrackingSettings())


@pytest.mark.slow
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
    assert tracker.client.get_run(run.id).info.run_name == "after all"
