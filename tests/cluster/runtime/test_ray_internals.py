"""A cluster without the dashboard: less is running, and nothing that anyone relies on is missing."""

import os
import subprocess
import sys

import pytest

from cluster.runtime import ray_internals

SPECTATORS = ("log_monitor.py", "dashboard.py")

LOOK = """
import os, sys, time
import ray
import psutil
from pathlib import Path
from ray.exceptions import RayActorError
from cluster.config import RaySettings
from cluster.runtime.session import connect
def tell(*words):
    print("own:", *words)
class Worker:
    def speak(self):
        print("spoken", flush=True)
    def die(self):
        os.kill(os.getpid(), 9)
def said(logs):
    return any("spoken" in path.read_text() for path in logs.glob("worker-*.out"))
def commands():
    return [" ".join(child.cmdline()) for child in psutil.Process().children(recursive=True)]
with connect(RaySettings(num_cpus=1), None, tuple(sys.argv[2:])):
    running = commands()
    tell("running", *(name for name in sys.argv[1].split(",") if any(name in line for line in running)))
    tell("metrics", ray._private.state.state.get_system_config().get("enable_metrics_collection", True))
    worker = ray.remote(Worker).remote()
    ray.get(worker.speak.remote())
    deadline = time.monotonic() + 60
    logs = Path(ray._private.worker._global_node.get_logs_dir_path())
    while not said(logs) and time.monotonic() < deadline:
        time.sleep(0.1)
    tell("logged", said(logs))
    try:
        ray.get(worker.die.remote(), timeout=120)
    except RayActorError:
        tell("death told")
tell("environment", *(name for name in ("REPORTER_UPDATE_INTERVAL_MS",) if name in os.environ))
"""


def test_what_the_user_has_chosen_is_left_alone(monkeypatch):
    monkeypatch.setenv("RAY_enable_metrics_collection", "1")
    monkeypatch.setenv("RAY_worker_niceness", "19")
    assert ray_internals.settings(ray_internals.PRIORITY, ray_internals.UNWATCHED) == {}


def test_metrics_are_off_unless_the_user_has_chosen(monkeypatch):
    monkeypatch.delenv("RAY_enable_metrics_collection", raising=False)
    assert ray_internals.settings(ray_internals.UNWATCHED) == {"enable_metrics_collection": False}


@pytest.mark.parametrize("before", [None, "1234"])
def test_a_later_cluster_does_not_inherit_the_agents_settings(monkeypatch, before):
    name = "REPORTER_UPDATE_INTERVAL_MS"
    monkeypatch.setenv(name, before or "")
    if before is None:
        monkeypatch.delenv(name)
    with ray_internals.quiet_agent():
        assert os.environ[name] == (before or ray_internals.AGENT[name])
    assert os.environ.get(name) == before


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parts", "running", "metrics"),
    [((), "running", "metrics False"), (("dashboard",), " ".join(["running", *SPECTATORS]), "metrics True")],
    ids=["without the dashboard", "with it"],
)
def test_logs_are_written_and_deaths_told_whatever_runs_beside(parts, running, metrics):
    command = [sys.executable, "-c", LOOK, ",".join(SPECTATORS), *parts]
    said = subprocess.run(command, capture_output=True, text=True, timeout=400, check=True).stdout
    # Ray tells of the death, too, in as many lines as it likes.
    own = [line.removeprefix("own: ") for line in said.splitlines() if line.startswith("own: ")]
    assert own == [running, metrics, "logged True", "death told", "environment"]
