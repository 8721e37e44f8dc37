"""The store's real pages in a real browser."""

import signal
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from cluster.errors import UserError
from cluster.tracking.server import serve_ui
from tests import chromium

REPOSITORY = Path(__file__).parents[3]


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
    options = (f"--user-data-dir={profile}", "--window-size=1400,900", "--virtual-time-budget=30000")
    command = chromium.command(*options, "--dump-dom", page)
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=240).stdout


def test_the_served_page_lists_the_run_and_an_interrupt_ends_the_server(served, free_port, tmp_path):
    process, page = served
    assert page.startswith(f"http://127.0.0.1:{free_port}/#/experiments/")
    assert "franka push of the browser test" in browse(page, tmp_path / "profile")
    process.send_signal(signal.SIGINT)
    process.wait(timeout=180)
    assert not answers(free_port)


@pytest.mark.slow
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
