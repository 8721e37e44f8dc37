"""A STOP that works when the console does not: one button's answer, in a process of its own.

Run as `python -m cluster.console.stop_service`. It knows one robot, takes a form with the robot's stop key,
and does what `svaedc hardware stop` does.
"""

import argparse
import hmac
import html
import json
import secrets
import ssl
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any, Final
from urllib.parse import parse_qs

from cluster.errors import UserError
from cluster.hardware.robot import stopping
from workers.host import durable

KEY: Final = "stop.key"
_LONGEST: Final = 4096  # bytes of a form
_PAGE: Final = """<!doctype html><html lang="en"><head><meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1"><title>{title}</title></head>
<body style="font: 20px/1.5 system-ui, sans-serif; max-width: 40rem; margin: 2rem auto; padding: 0 1rem">
<h1 style="font-size: 1.6rem">{title}</h1><p>{said}</p>
<p><a href="{back}">Back to the console</a></p></body></html>
"""


def stop_key(home: Path) -> str:
    """What every form that stops the robot must hold, so that no other web page stops it.

    Args:
        home: the robot's; the key is made at the first call, and stays.

    Returns:
        The key.

    Raises:
        OSError: it cannot be read or written.
    """
    path = home / KEY
    with durable.exclusively(path.with_suffix(".lock")):
        if not path.exists():
            durable.replace(path, secrets.token_urlsafe(16).encode(), mode=0o600)
    return path.read_text(encoding="utf-8").strip()


class StopServer(ThreadingHTTPServer):
    """Answers the button.

    Args:
        address: host and port.
        robot: its name.
        home: of the robot.
        back: address of the console.
    """

    daemon_threads = True
    request_queue_size = 128

    def __init__(self, address: tuple[str, int], robot: str, home: Path, back: str) -> None:
        self.robot, self.home, self.back = robot, home, back
        self.key = stop_key(home)
        super().__init__(address, _Answer)

    def stop(self, who: str) -> str:
        """Stop the robot; returns what the person in charge must know."""
        try:
            return stopping.stop(self.robot, self.home, who, "STOP was pressed in the console").advice
        except UserError as error:
            return f"{error}. USE THE ROBOT'S OWN EMERGENCY STOP"


class _Answer(BaseHTTPRequestHandler):
    server: StopServer
    server_version, sys_version = "svaedc", ""
    timeout = 10.0

    def do_GET(self) -> None:
        """Say who is here, for the console."""
        about = {"robot": self.server.robot, "home": str(self.server.home)}
        self._send(HTTPStatus.OK, json.dumps(about), "application/json")

    def do_POST(self) -> None:
        """Stop the robot, if the form knows its key."""
        form = self._form()
        if not hmac.compare_digest(form.get("key", "").encode(), self.server.key.encode()):
            said = "This page does not know the robot's stop key: reload it, or USE ITS OWN EMERGENCY STOP."
            self._tell(HTTPStatus.FORBIDDEN, "NOT stopped", said)
            return
        said = self.server.stop(form.get("who", "")[:80] or "somebody at the console")
        self._tell(HTTPStatus.OK, "STOP", said)

    def _form(self) -> dict[str, str]:
        try:
            length = min(int(self.headers.get("Content-Length") or 0), _LONGEST)
        except ValueError:
            length = 0
        found = parse_qs(self.rfile.read(max(length, 0)).decode("utf-8", "replace"))
        return {name: values[0] for name, values in found.items()}

    def _tell(self, status: HTTPStatus, title: str, said: str) -> None:
        back = html.escape(self.server.back, quote=True)
        text = _PAGE.format(title=html.escape(title), said=html.escape(said), back=back)
        self._send(status, text, "text/html; charset=utf-8")

    def _send(self, status: HTTPStatus, text: str, kind: str) -> None:
        body = text.encode()
        self.send_response(status)
        for name, value in (
            ("Content-Type", kind),
            ("Content-Length", str(len(body))),
            ("Cache-Control", "no-store"),
            ("X-Content-Type-Options", "nosniff"),
            (
                "Content-Security-Policy",
                "default-src 'none'; style-src 'unsafe-inline'; frame-ancestors 'none'",
            ),
        ):
            self.send_header(name, value)
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, format: str, *args: Any) -> None:
        """Every stop is in the robot's ledger; all else says nothing."""


def main() -> None:
    """Serve until killed."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robot", required=True)
    parser.add_argument("--home", type=Path, required=True)
    parser.add_argument("--address", required=True)
    parser.add_argument("--port", type=int, required=True)
    parser.add_argument("--back", required=True, help="Address of the console.")
    parser.add_argument("--certificate", type=Path)
    parser.add_argument("--key", type=Path)
    asked = parser.parse_args()
    server = StopServer((asked.address, asked.port), asked.robot, asked.home, asked.back)
    if asked.certificate:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.load_cert_chain(asked.certificate, asked.key)
        server.socket = context.wrap_socket(server.socket, server_side=True, do_handshake_on_connect=False)
    server.serve_forever()


if __name__ == "__main__":
    main()
