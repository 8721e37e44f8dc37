"""Uploads to an object store appear whole or not at all."""

import math
import signal
import socket
import subprocess
import sys
import threading

import pytest

from tests.workers.dataset.storage.contents import content
from workers.dataset.storage.location import location
from workers.dataset.storage.temporary import WRITING

UPLOAD = """
import sys
from workers.dataset.storage.location import location
location(sys.argv[1]).write_bytes(bytes(int(sys.argv[2])))
"""


@pytest.mark.parametrize("size", [9_000_000, 25_000_000], ids=["one request", "several parts"])
def test_an_upload_that_is_killed_half_way_leaves_nothing(size, object_store, bucket):
    with Relay(object_store, size // 2) as relay:
        options = f"endpoint_override={relay.address}&region=us-east-1&scheme=http"
        command = [sys.executable, "-c", UPLOAD, f"s3://{bucket}/file?{options}", str(size)]
        with subprocess.Popen(command) as process:
            assert relay.is_half_way.wait(120)
            process.kill()
        assert process.returncode == -signal.SIGKILL
    seen = location(f"s3://{bucket}?endpoint_override={object_store}&region=us-east-1&scheme=http")
    assert list(seen.iterdir()) == []
    (seen / "file").write_bytes(b"whole")
    assert content(seen) == {"file": b"whole"}


@pytest.mark.parametrize("part", [1, 2])
def test_an_upload_of_which_a_part_is_refused_leaves_nothing_and_can_be_repeated(part, object_store, bucket):
    with Relay(object_store, refused=f"partNumber={part}&".encode()) as relay:
        options = f"endpoint_override={relay.address}&region=us-east-1&scheme=http"
        command = [sys.executable, "-c", UPLOAD, f"s3://{bucket}/data/file?{options}", "25000000"]
        failed = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert failed.returncode == 1
    assert "StoreError" in failed.stderr
    seen = location(f"s3://{bucket}/data?endpoint_override={object_store}&region=us-east-1&scheme=http")
    assert list(seen.iterdir()) == list((seen / WRITING).iterdir()) == []
    (seen / "file").write_bytes(bytes(25_000_000))
    assert [(path.name, path.stat().st_size) for path in seen.iterdir()] == [("file", 25_000_000)]
    assert list((seen / WRITING).iterdir()) == []


REFUSAL = b"HTTP/1.1 400 Bad Request\r\nContent-Length: 0\r\nConnection: close\r\n\r\n"


class Relay:
    """Passes bytes between clients and a server.

    It keeps all after the first `limit` bytes of the clients, and refuses requests with some text in their
    first line.
    """

    def __init__(self, server: str, limit: float = math.inf, refused: bytes = b"") -> None:
        host, port = server.split(":")
        self.is_half_way = threading.Event()
        self._server, self._left, self._refused = (host, int(port)), limit, refused
        self._listener = socket.create_server(("127.0.0.1", 0))
        self._sockets = [self._listener]
        self.address = f"127.0.0.1:{self._listener.getsockname()[1]}"

    def __enter__(self) -> "Relay":
        threading.Thread(target=self._accept, daemon=True).start()
        return self

    def __exit__(self, *_: object) -> None:
        for each in self._sockets:
            each.close()

    def _accept(self) -> None:
        while True:
            try:
                client, _ = self._listener.accept()
            except OSError:
                return
            server = socket.create_connection(self._server)
            self._sockets += [client, server]
            threading.Thread(target=self._upload, args=(client, server), daemon=True).start()
            threading.Thread(target=self._pass, args=(server, client), daemon=True).start()

    def _upload(self, client: socket.socket, server: socket.socket) -> None:
        while not self.is_half_way.is_set():
            block = client.recv(1 << 16)
            if not block:
                return
            if self._refused and self._refused in block.partition(b"\r\n")[0]:
                client.sendall(REFUSAL)
                client.close()
                return
            server.sendall(block)
            self._left -= len(block)
            if self._left <= 0:
                self.is_half_way.set()

    def _pass(self, source: socket.socket, target: socket.socket) -> None:
        try:
            while block := source.recv(1 << 16):
                target.sendall(block)
        except OSError:
            return
