"""Serves the MLflow pages of this project's store on loopback, until interrupted."""

import ctypes
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from cluster.config import TrackingSettings
from cluster.errors import UsageError, UserError
from cluster.runtime.signals import terminating_as_exit
from cluster.tracking import UI_PORT, open_tracker

HOST = "127.0.0.1"
PR_SET_PDEATHSIG = 1
"""This option of Linux's `prctl` sets the signal that a process gets when its parent dies."""
START_SECONDS = 120.0
STOP_SECONDS = 10.0


def serve_ui(settings: TrackingSettings, port: int, announce: Callable[[str], None]) -> None:
    """Runs the MLflow server on loopback until Ctrl-C, SIGTERM, or its own end.

    Args:
        settings: the store to show.
        port: TCP port on 127.0.0.1.
        announce: called once with the page's address, when it answers.

    Raises:
        UsageError: the store is a server already.
        UserError: the store cannot be opened, the port is taken, or the server does not start.
    """
    tracker = open_tracker(settings)
    if tracker.uri.startswith("http"):
        raise UsageError(f"tracking.uri is a server already, open {tracker.page} in a browser")
    _require_free(port)
    with terminating_as_exit(), _server(tracker.client.tracking_uri, port) as server:
        _wait_until_up(server, port)
        announce(tracker.page.replace(f":{UI_PORT}/", f":{port}/"))
        server.wait()
    if server.returncode:
        raise UserError(f"the MLflow server ended with code {server.returncode}; its own message is above")


def _require_free(port: int) -> None:
    """Refuses a port that something else serves, which MLflow would report only in a traceback."""
    with socket.socket() as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((HOST, port))
        except OSError as error:
            raise UserError(
                f"port {port} cannot be served: {error.strerror}; try --port {port + 1}"
            ) from error


@contextmanager
def _server(uri: str, port: int) -> Iterator[subprocess.Popen[bytes]]:
    """The server in a process group of its own, because it has children; it ends with the block.

    Should this process be killed outright, the kernel asks the server to stop.
    """
    command = [
        sys.executable,
        "-m",
        "mlflow",
        "server",
        "--backend-store-uri",
        uri,
        "--registry-store-uri",
        uri,
    ]
    command += ["--host", HOST, "--port", str(port), "--workers", "1"]
    quiet = {"MLFLOW_SERVER_ENABLE_JOB_EXECUTION": "false", "MLFLOW_DISABLE_TELEMETRY": "true"}
    alone = {"PYTHONSAFEPATH": "1"}  # a user's `random.py` in the working directory is not Python's
    prctl = ctypes.CDLL(None).prctl
    server = subprocess.Popen(
        command,
        env={**os.environ, **quiet, **alone},
        stdout=sys.stderr.fileno(),
        start_new_session=True,
        preexec_fn=lambda: prctl(PR_SET_PDEATHSIG, signal.SIGTERM),
    )
    try:
        yield server
    finally:
        _end(server)


def _end(server: subprocess.Popen[bytes]) -> None:
    """Asks the whole group to stop, and insists after a while."""
    for order in (signal.SIGTERM, signal.SIGKILL):
        try:
            os.killpg(server.pid, order)
            server.wait(STOP_SECONDS)
        except ProcessLookupError:
            return
        except subprocess.TimeoutExpired:
            continue


def _wait_until_up(server: subprocess.Popen[bytes], port: int) -> None:
    """Returns when the port accepts a connection."""
    deadline = time.monotonic() + START_SECONDS
    while server.poll() is None and time.monotonic() < deadline:
        with socket.socket() as probe:
            if probe.connect_ex((HOST, port)) == 0:
                return
        time.sleep(0.2)
    raise UserError(f"the MLflow server did not answer on {HOST}:{port}; its own message is above")
