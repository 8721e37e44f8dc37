"""Containers: no HOME, a user without a name, a home in which nothing can be written."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from cluster.config import Settings, TrainSettings
from cluster.errors import UsageError
from cluster.home import cache_folder
from cluster.settings import load_settings

REPOSITORY = Path(__file__).parents[2]
NAMELESS = ["unshare", "--user", "--map-user=12345", "--map-group=12345", "env", "-u", "HOME"]
"""A process of a user who has no name, where the system lets users have name spaces of their own."""


@pytest.fixture(scope="module")
def homeless():
    """What runs a program without a home, and returns what it said."""
    if shutil.which("unshare") is None or subprocess.run([*NAMELESS, "true"], check=False).returncode:
        pytest.skip("this system gives users no name spaces of their own")

    def run(program: str) -> str:
        done = subprocess.run(
            [*NAMELESS, sys.executable, "-c", program],
            cwd=REPOSITORY,
            capture_output=True,
            encoding="utf-8",
            check=False,
        )
        assert "Traceback" not in done.stderr, done.stderr
        return done.stdout + done.stderr

    return run


def test_help_and_settings_need_no_home(homeless):
    assert "Usage: " in homeless("from cluster.cli.main import main; main()")
    said = homeless("from cluster.config import Settings; print(Settings().train.cache_folder)")
    assert said.endswith("svaedc-12345\n")


@pytest.mark.slow
def test_runs_are_recorded_without_a_home_or_a_name(homeless, tmp_path):
    said = homeless(
        "from cluster.config import TrackingSettings; from cluster.tracking import open_tracker\n"
        f"tracker = open_tracker(TrackingSettings(uri='sqlite:///{tmp_path}/mlflow.db'))\n"
        "with tracker.run('nameless', 'collect', {}) as run: pass\n"
        "print(tracker.client.get_run(run.id).data.tags['mlflow.user'])"
    )
    assert said.endswith("12345\n")


def test_a_path_in_a_home_that_is_not_known_is_refused_with_the_remedy(homeless):
    program = "import sys; from cluster.cli.main import main; sys.argv = {!r}; main()"
    said = homeless(program.format(["svaedc", "dataset", "info", "~/data"]))
    assert (
        said
        == "error: ~/data begins with a home that is not known here: set HOME, or give an absolute path\n"
    )


def test_nobodys_home_is_a_mistake_in_a_setting():
    with pytest.raises(UsageError, match=r"train\.cache_folder: .*home that is not known here"):
        load_settings(None, ["train.cache_folder=~nobody-of-this-name/cache"])


def test_the_cache_lies_in_the_home_where_it_can(monkeypatch, tmp_path):
    monkeypatch.setenv("HOME", str(tmp_path))
    assert cache_folder() == TrainSettings().cache_folder == tmp_path / ".cache" / "svaedc"
    assert not list(tmp_path.iterdir())


def test_the_cache_lies_beside_the_temporary_files_where_the_home_cannot_be_written(monkeypatch):
    monkeypatch.setenv("HOME", "/dev/null/home")
    assert Settings().train.cache_folder.name == f"svaedc-{os.getuid()}"
