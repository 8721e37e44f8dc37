"""The command itself: where it listens, what it refuses, and what is left when it is killed."""

import os
import signal
import socket
import subprocess
import sys
import time

import pytest
import requests

from cluster.console.serve import Place
from cluster.errors import UsageError
from tests.cluster.console.served import awaiting_approval
from workers.host.home import RobotHome

LEFT = "the console is closed; the campaign and its robot go on as they were"


@pytest.fixture
def ports():
    """Two free ports in a row."""
    while True:
        with socket.socket() as one, socket.socket() as other:
            one.bind(("127.0.0.1", 0))
            port = one.getsockname()[1]
            try:
                other.bind(("127.0.0.1", port + 1))
            except OSError:
                continue
            return port


def started(folder, port, *options):
    command = [
        sys.executable,
        "-m",
        "cluster",
        "hardware",
        "console",
        str(folder),
        "--port",
        str(port),
        *options,
    ]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)


def line_with(process, word):
    seen = []
    while line := process.stdout.readline():
        seen.append(line.rstrip())
        if word in line:
            return seen[-1]
    raise AssertionError(seen)


def ended(process, signal_number):
    """The exit code of a console that was asked to end, and its last words."""
    process.send_signal(signal_number)
    said, _ = process.communicate(timeout=120)
    return process.returncode, said


def home_of(folder):
    return RobotHome(folder.parent / "home", "any")


def listens(port):
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def test_stop_works_when_the_console_was_killed(tmp_path, ports):
    awaiting_approval(tmp_path / "campaign")
    console = started(tmp_path / "campaign", ports)
    try:
        token = line_with(console, "once").rpartition(" ")[2]
        page = requests.get(
            f"http://127.0.0.1:{ports}/", headers={"Authorization": f"Bearer {token}"}, timeout=60
        )
        key = page.text.rpartition("/stop")[2].partition('value="')[2].partition('"')[0]
        console.kill()
        console.communicate()
        answer = requests.post(f"http://127.0.0.1:{ports + 1}/stop", {"key": key, "who": "Ada"}, timeout=60)
        assert answer.status_code == 200
        assert str(home_of(tmp_path / "campaign").latch.read()).startswith("stopped by Ada")
        again = started(tmp_path / "campaign", ports)  # finds STOP where it was
        line_with(again, "open http")
        assert ended(again, signal.SIGINT) == (130, f"stopped: {LEFT}\n")
    finally:
        for process in ending(ports + 1):
            os.kill(process, signal.SIGTERM)
    wait_until(lambda: not listens(ports + 1))


def ending(port):
    """Processes that serve STOP on a port."""
    found = subprocess.run(
        ["pgrep", "-f", f"stop_service.*--port {port} "], capture_output=True, text=True, check=False
    )
    return [int(line) for line in found.stdout.split()]


def wait_until(holds):
    deadline = time.monotonic() + 60
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_stop_ends_with_a_console_that_ends_well(tmp_path, ports):
    awaiting_approval(tmp_path / "campaign")
    console = started(tmp_path / "campaign", ports)
    line_with(console, "once")
    assert ended(console, signal.SIGTERM) == (143, f"stopped: {LEFT}\n")
    wait_until(lambda: not listens(ports + 1))


def test_two_consoles_do_not_share_a_port(tmp_path, ports):
    awaiting_approval(tmp_path / "campaign")
    with socket.create_server(("127.0.0.1", ports)):
        console = started(tmp_path / "campaign", ports)
        said = console.communicate(timeout=120)[0]
    assert console.returncode == 1
    assert f"cannot serve 127.0.0.1:{ports}: Address already in use; try --port {ports + 2}" in " ".join(
        said.split()
    )


def test_a_port_of_stop_that_something_else_has_is_told(tmp_path, ports):
    awaiting_approval(tmp_path / "campaign")
    with socket.create_server(("127.0.0.1", ports + 1)):
        console = started(tmp_path / "campaign", ports)
        said = console.communicate(timeout=120)[0]
    assert console.returncode == 1
    assert f"STOP cannot be served on 127.0.0.1:{ports + 1}" in " ".join(said.split())


@pytest.mark.parametrize("address", ["0.0.0.0", "192.168.0.7", "robot.example", "::"])
def test_other_machines_are_answered_through_tls_alone(address):
    with pytest.raises(UsageError, match="tokens in the clear: give --certificate FILE --key FILE"):
        Place(address)


def test_a_certificate_needs_its_key(tmp_path):
    with pytest.raises(UsageError, match="belong together"):
        Place(certificate=tmp_path / "a.pem")


def test_a_browser_may_know_it_by_name_or_address(tmp_path):
    pem = tmp_path / "a.pem"
    assert Place().hosts == ("127.0.0.1:8400", "localhost:8400")
    place = Place("0.0.0.0", 9000, pem, pem, ("robot.example",))
    assert place.hosts[0] == "robot.example:9000"
    assert (place.url, place.stop_url) == ("https://robot.example:9000/", "https://robot.example:9001/stop")


def test_both_are_served_through_tls(tmp_path, ports):
    awaiting_approval(tmp_path / "campaign")
    certificate, key = tmp_path / "certificate.pem", tmp_path / "key.pem"
    subprocess.run(
        ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost",
         "-addext", "subjectAltName=DNS:localhost,IP:127.0.0.1", "-out", certificate, "-keyout", key],
        check=True, capture_output=True,
    )  # fmt: skip
    console = started(tmp_path / "campaign", ports, "--certificate", certificate, "--key", key)
    try:
        token = line_with(console, "once").rpartition(" ")[2]
        program = requests.Session()
        program.trust_env = False
        program.verify, program.headers["Authorization"] = str(certificate), f"Bearer {token}"
        answer = program.get(f"https://127.0.0.1:{ports}/state", timeout=60)
        assert answer.json()["phase"] == "awaits approval"
        assert answer.headers["strict-transport-security"]
        assert program.get(f"https://127.0.0.1:{ports + 1}/", timeout=60).json()["home"] == str(
            tmp_path / "home"
        )
        with pytest.raises(requests.ConnectionError):
            requests.get(f"http://127.0.0.1:{ports}/enter", timeout=60)
    finally:
        ended(console, signal.SIGTERM)


def test_a_certificate_that_is_none_is_told(tmp_path, ports):
    awaiting_approval(tmp_path / "campaign")
    pem = tmp_path / "a.pem"
    pem.write_text("nothing")
    console = started(tmp_path / "campaign", ports, "--certificate", pem, "--key", pem)
    said = " ".join(console.communicate(timeout=120)[0].split())
    assert (console.returncode, "cannot use" in said, "Traceback" in said) == (2, True, False)
