"""Fixtures shared by all tests; they import the packages inside, after the type checker is in place."""

import atexit
import os
import secrets
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

# No test asserts a time, the machine may be busy; and the same examples every time, so that a failure belongs
# to the change that caused it: `make test-slow` explores new ones.
settings.register_profile("untimed", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.register_profile("repeatable", settings.get_profile("untimed"), derandomize=True)
settings.register_profile("exploring", settings.get_profile("untimed"), max_examples=500)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

# A shell starts what it puts into the background with Ctrl-C ignored, and children inherit that.
signal.signal(signal.SIGINT, signal.default_int_handler)

# Nothing in a test reports home, and every process has one thread: tests share few cores.
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
os.environ["DO_NOT_TRACK"] = "true"
# Ray: clusters listen on loopback only. It is read when Ray is imported.
os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"
# Clusters of the tests have a token of their own and leave ~/.ray alone.
os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)
os.environ.setdefault("OMP_NUM_THREADS", "1")
# Robots of the tests have their homes in a folder of this run.
os.environ["XDG_STATE_HOME"] = tempfile.mkdtemp(prefix="svaedc-tests-")
atexit.register(shutil.rmtree, os.environ["XDG_STATE_HOME"], ignore_errors=True)
# Object stores of the tests are on loopback, and nobody's own account or store is found by accident.
for name in ("AWS_PROFILE", "AWS_SESSION_TOKEN", "AWS_ENDPOINT_URL", "AWS_ENDPOINT_URL_S3", "AWS_REGION"):
    os.environ.pop(name, None)
os.environ["AWS_CONFIG_FILE"] = os.environ["AWS_SHARED_CREDENTIALS_FILE"] = os.devnull
os.environ["AWS_EC2_METADATA_DISABLED"] = "true"
os.environ["AWS_ACCESS_KEY_ID"] = os.environ["AWS_SECRET_ACCESS_KEY"] = "tests"
os.environ["AWS_DEFAULT_REGION"] = "us-east-1"


@pytest.fixture(scope="session")
def ray_session():
    """One local Ray cluster of four logical CPUs for all tests that need one."""
    from cluster.config import RaySettings
    from cluster.runtime.session import connect

    with connect(RaySettings(num_cpus=4, object_store_memory=150_000_000), address=None) as session:
        yield session


@pytest.fixture
def tracking_settings(tmp_path: Path):
    """Settings of a fresh MLflow store in a folder of the test's own."""
    from cluster.config import TrackingSettings

    return TrackingSettings(uri=f"sqlite:///{tmp_path}/store/mlflow.db", experiment="tests")


@pytest.fixture
def free_port() -> int:
    """A TCP port on loopback that nothing serves just now."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


@pytest.fixture
def gentle(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of the importable module `gentle`, a user's own with functions of badness."""
    from tests.gentle import SOURCE

    path = tmp_path / "modules" / "gentle.py"
    path.parent.mkdir()
    path.write_text(SOURCE)
    monkeypatch.syspath_prepend(path.parent)
    monkeypatch.delitem(sys.modules, "gentle", raising=False)
    return path


@pytest.fixture(scope="session")
def object_store(tmp_path_factory: pytest.TempPathFactory):
    """Host and port of a server on loopback that answers as Amazon's S3 does."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    with (tmp_path_factory.mktemp("store") / "log").open("wb") as log:
        process = subprocess.Popen(command, stdout=log, stderr=log)
    try:
        deadline = time.monotonic() + 300
        with socket.socket() as probe:
            while probe.connect_ex(("127.0.0.1", port)) != 0:
                assert process.poll() is None
                assert time.monotonic() < deadline
                time.sleep(0.05)
        yield f"127.0.0.1:{port}"
    finally:
        process.kill()
        process.wait(timeout=60)


@pytest.fixture
def bucket(object_store: str) -> str:
    """The name of a new bucket."""
    name = f"bucket-{secrets.token_hex(4)}"
    request = urllib.request.Request(f"http://{object_store}/{name}", method="PUT")
    urllib.request.urlopen(request, timeout=60).close()
    return name


@pytest.fixture(scope="session")
def franka_dataset(ray_session, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A real dataset that is just large enough to train on, collected once."""
    return _collected(240, 40, ray_session, tmp_path_factory)


@pytest.fixture(scope="session")
def small_dataset(ray_session, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A real dataset of two shards."""
    return _collected(16, 8, ray_session, tmp_path_factory)


def _collected(episodes: int, per_shard: int, session, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from cluster.config import CollectSettings, TrackingSettings
    from cluster.datasets.collect import collect
    from cluster.datasets.plan import plan_collection
    from cluster.tracking import open_tracker
    from workers import setups

    folder = tmp_path_factory.mktemp("collected")
    collect(
        plan_collection(
            setup=setups.load("franka"),
            episodes=episodes,
            folder=folder / "dataset",
            seed=0,
            settings=CollectSettings(actors=2, episodes_per_shard=per_shard),
        ),
        CollectSettings(actors=2, episodes_per_shard=per_shard),
        session,
        open_tracker(TrackingSettings(uri=f"sqlite:///{folder}/mlflow.db")),
    )
    return folder / "dataset"


@pytest.fixture(scope="session")
def hebi_python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A Python with the maker's library of the hexapod, where that can be installed; and a tape measure."""
    folder = tmp_path_factory.mktemp("hebi")
    subprocess.run([sys.executable, "-m", "venv", folder / "environment"], check=True)
    inside = folder / "environment" / "bin"
    wanted = [inside / "pip", "install", "-q", "hebi-py==2.16.1", "jaxtyping==0.3.11"]
    done = subprocess.run(wanted, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"hebi-py cannot be installed here: {done.stderr[-200:]}")
    (folder / "tape.py").write_text("def walked():\n    return 1.5\n")
    python = folder / "python"
    python.write_text(f'#!/bin/sh\ncd {folder} && exec {inside / "python"} "$@"\n')
    python.chmod(0o700)
    return python
