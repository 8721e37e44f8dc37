"""A Ray head started apart from the tests, as `ray start` does it, with a token of its own."""

import os
import signal
import socket
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import pytest
from ray.cluster_utils import Cluster

RAY = Path(sys.executable).parent / "ray"
MACHINE = {"include_dashboard": False, "object_store_memory": 100_000_000}


@dataclass(frozen=True)
class Head:
    """A running cluster on loopback."""

    address: str
    dashboard: str
    token: str
    folder: Path
    home: Path


def free_ports(count: int) -> list[int]:
    """Distinct free ports, above those that Ray gives its workers."""
    probes = [socket.socket() for _ in range(count)]
    for probe in probes:
        probe.bind(("127.0.0.1", 0))
    ports = [probe.getsockname()[1] for probe in probes]
    for probe in probes:
        probe.close()
    return ports


@pytest.fixture(scope="module")
def head(tmp_path_factory):
    """Four logical CPUs behind token authentication; ended by its process id."""
    port, dashboard, agent, client = free_ports(4)
    folder, home = tmp_path_factory.mktemp("r"), tmp_path_factory.mktemp("home")
    token = "a" * 64
    command = [str(RAY), "start", "--head", "--block", "--disable-usage-stats", "--num-cpus=4"]
    command += ["--node-ip-address=127.0.0.1", f"--port={port}", f"--ray-client-server-port={client}"]
    command += ["--dashboard-host=127.0.0.1", f"--dashboard-port={dashboard}", f"--temp-dir={folder}"]
    command += [f"--dashboard-agent-listen-port={agent}"]
    command += ["--object-store-memory=150000000"]
    environment = {**os.environ, "RAY_AUTH_MODE": "token", "RAY_AUTH_TOKEN": token, "HOME": str(home)}
    with (folder / "head.log").open("wb") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log, start_new_session=True)
    try:
        wait_until_served(process, [port, dashboard, agent], folder / "head.log")
        yield Head(f"127.0.0.1:{port}", f"http://127.0.0.1:{dashboard}", token, folder, home)
    finally:
        process.send_signal(signal.SIGTERM)
        process.wait(timeout=180)


@pytest.fixture
def machines():
    """A cluster on loopback to which machines may be added, and from which they may be torn.

    Its head has no CPUs. Its token is that of all tests: a process keeps the first one that it has shown.
    """
    from cluster.runtime.ray_internals import use_token

    use_token()
    # Ray leaves a socket open where the port is taken, as its usual one is while another cluster runs here.
    head = {"num_cpus": 0, "dashboard_port": free_ports(1)[0], **MACHINE}
    cluster = Cluster(initialize_head=True, head_node_args=head)
    yield cluster
    cluster.shutdown()


def wait_until_served(process: subprocess.Popen, ports: list[int], log: Path) -> None:
    """Returns when all ports answer; fails with the head's own output."""
    deadline = time.monotonic() + 300
    while not all(answers(port) for port in ports):
        if process.poll() is not None or time.monotonic() > deadline:
            pytest.fail(f"ray start did not come up: {log.read_text()}")
        time.sleep(0.2)


def answers(port: int) -> bool:
    """Whether something accepts connections on a port of loopback."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0
