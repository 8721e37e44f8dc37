"""Fixtures shared by all tests; they import the packages inside, after the type checker is in place."""

import os
import secrets
import socket
from pathlib import Path

import pytest

# Nothing in a test reports home, and every process has one thread: tests share few cores.
os.environ["RAY_USAGE_STATS_ENABLED"] = "0"
os.environ["MLFLOW_DISABLE_TELEMETRY"] = "true"
os.environ["DO_NOT_TRACK"] = "true"
# Ray: clusters listen on loopback only. It is read when Ray is imported.
os.environ["RAY_ENABLE_WINDOWS_OR_OSX_CLUSTER"] = "0"
# Clusters of the tests have a token of their own and leave ~/.ray alone.
os.environ["RAY_AUTH_TOKEN"] = secrets.token_hex(32)
os.environ.setdefault("OMP_NUM_THREADS", "1")


@pytest.fixture(scope="session")
def ray_session():
    """One local Ray cluster of four logical CPUs for all tests that need one."""
    from cluster.config import RaySettings
    from cluster.session import connect

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
