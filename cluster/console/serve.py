"""`svaedc hardware console`: one campaign's console, on loopback unless it is told how else to be safe."""

import ipaddress
import json
import os
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from getpass import getuser
from pathlib import Path
from types import FrameType
from typing import Any, Final
from urllib.request import urlopen

import uvicorn

from cluster.console.access import AccessTokens, Role
from cluster.console.app import application
from cluster.console.asking import Console
from cluster.console.desk import Desk
from cluster.console.guards import Guards
from cluster.console.pages import Pages, Stopper
from cluster.console.sessions import Sessions
from cluster.console.stop_service import stop_key
from cluster.errors import UsageError, UserError
from cluster.hardware.robot.residence import robot_errors
from cluster.runtime.signals import interruptible, terminating_as_exit

PORT: Final = 8400
LOG: Final = "stop-service.log"
_START_SECONDS: Final = 20.0
_END_SECONDS: Final = 2
_LEFT: Final = "the console is closed; the campaign and its robot go on as they were"


@dataclass(frozen=True)
class Place:
    """Where a console is reached.

    Attributes:
        address: that it listens on.
        port: of the console; STOP has the next one.
        certificate: for TLS, a file of PEM; None for none.
        key: of the certificate.
        names: under which browsers reach it, besides the address.
    """

    address: str = "127.0.0.1"
    port: int = PORT
    certificate: Path | None = None
    key: Path | None = None
    names: tuple[str, ...] = field(default=())

    def __post_init__(self) -> None:
        """Refuse to be reached from elsewhere in the clear.

        Raises:
            UsageError: the address is not this machine's own loopback, and there is no certificate.
        """
        if (self.certificate is None) is not (self.key is None):
            raise UsageError("a certificate and its key belong together: give both --certificate and --key")
        if not self.is_loopback and self.certificate is None:
            raise UsageError(
                f"the address {self.address} is reached from other machines, and the console would tell them "
                "tokens in the clear: give --certificate FILE --key FILE, or leave --address out and come "
                "through `ssh -L`"
            )

    @property
    def is_loopback(self) -> bool:
        """Whether only this machine reaches it."""
        try:
            return ipaddress.ip_address(self.address).is_loopback
        except ValueError:
            return self.address == "localhost"

    @property
    def scheme(self) -> str:
        """Of its address in a browser."""
        return "https" if self.certificate else "http"

    @property
    def hosts(self) -> tuple[str, ...]:
        """Every name, with port, that a browser may ask for it by."""
        own = ("127.0.0.1", "localhost") if self.is_loopback else (socket.gethostname(),)
        known = dict.fromkeys((*self.names, self.address, *own))
        return tuple(f"{name}:{self.port}" for name in known if name not in ("0.0.0.0", ""))

    @property
    def url(self) -> str:
        """What a person opens."""
        return f"{self.scheme}://{self.hosts[0]}/"

    @property
    def stop_url(self) -> str:
        """Where STOP is."""
        return f"{self.scheme}://{self.hosts[0].rpartition(':')[0]}:{self.port + 1}/stop"


def serve(folder: Path, place: Place, say: Callable[[str], None]) -> None:
    """Serve the console of a campaign until Ctrl-C or SIGTERM.

    Args:
        folder: of the campaign.
        place: where it is reached.
        say: is given sentences for the person in charge.

    Raises:
        UsageError: the certificate cannot be used.
        UserError: there is no campaign, or a port is taken.
    """
    desk = Desk.of(folder)
    with robot_errors():
        desk.home.make()
        key = stop_key(desk.home.path)
    tokens = AccessTokens(desk.home.path)
    first = _first_token(tokens)
    _require_certificate(place)
    listening = _listen(place)
    closing = threading.Event()
    with interruptible(_LEFT), terminating_as_exit(), _stop_service(desk, place):
        pages = Pages(desk, Stopper(place.stop_url, key))
        console = Console(desk, tokens, pages, place.scheme == "https", Sessions(), closing)
        guarded = Guards(application(console), place.hosts, place.scheme, place.stop_url.rpartition("/")[0])

        def announce() -> None:
            say(f"open {place.url}  (Ctrl-C ends it)")
            if first:
                say(f"your token, shown this once: {first}")

        _Server(_config(guarded, place), announce, closing).run(sockets=[listening])


class _Server(uvicorn.Server):
    """It says when it answers, and lets go of pages that listen before it waits for them."""

    def __init__(
        self, config: uvicorn.Config, announce: Callable[[], None], closing: threading.Event
    ) -> None:
        super().__init__(config)
        self._announce, self._closing = announce, closing

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Begin to answer."""
        await super().startup(sockets)
        self._announce()

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """Begin to end."""
        self._closing.set()
        super().handle_exit(sig, frame)


def _config(guarded: Guards, place: Place) -> uvicorn.Config:
    return uvicorn.Config(
        guarded,
        log_level="warning",
        ssl_certfile=place.certificate,
        ssl_keyfile=place.key,
        server_header=False,
        proxy_headers=False,
        lifespan="off",
        timeout_graceful_shutdown=_END_SECONDS,
    )


def _first_token(tokens: AccessTokens) -> str:
    """Somebody must be able to enter; "" where somebody is already."""
    return "" if tokens.all() else tokens.issue(_user(), Role.OPERATOR)


def _user() -> str:
    try:
        return getuser()
    except (KeyError, OSError):  # a container without names
        return f"user {os.getuid()}"


def _require_certificate(place: Place) -> None:
    if place.certificate is None:
        return
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(place.certificate, place.key)
    except OSError as error:  # of which what is wrong with a certificate is one kind
        raise UsageError(f"cannot use {place.certificate} with {place.key}: {error}") from error


def _listen(place: Place) -> socket.socket:
    try:
        return socket.create_server((place.address, place.port))
    except OSError as error:
        raise UserError(
            f"cannot serve {place.address}:{place.port}: {os.strerror(error.errno or 0)}; "
            f"try --port {place.port + 2}"
        ) from error


@contextmanager
def _stop_service(desk: Desk, place: Place) -> Iterator[None]:
    """STOP in a process of its own, which outlives this one if this one is killed."""
    if _is_served(desk, place):
        yield
        return
    command = [
        *(sys.executable, "-m", "cluster.console.stop_service", "--robot", desk.home.robot),
        *("--home", str(desk.home.path), "--address", place.address, "--port", str(place.port + 1)),
        *("--back", place.url),
    ]
    if place.certificate:
        command += ["--certificate", str(place.certificate), "--key", str(place.key)]
    alone = {**os.environ, "PYTHONSAFEPATH": "1"}
    streams: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stderr": subprocess.STDOUT}
    with (desk.home.path / LOG).open("ab") as log:  # not ours: whoever reads our output must see its end
        service = subprocess.Popen(command, env=alone, start_new_session=True, stdout=log, **streams)
    with service:
        try:
            _wait_until_served(service, desk, place)
            yield
        finally:
            service.terminate()


def _wait_until_served(service: subprocess.Popen[bytes], desk: Desk, place: Place) -> None:
    deadline = time.monotonic() + _START_SECONDS
    while not _is_served(desk, place):
        if service.poll() is not None or time.monotonic() > deadline:
            raise UserError(
                f"STOP cannot be served on {place.address}:{place.port + 1}, the port after the console's, "
                f"and there is no console without; try --port {place.port + 2}"
            )
        time.sleep(0.05)


def _is_served(desk: Desk, place: Place) -> bool:
    """Whether STOP of this very robot answers."""
    address = "127.0.0.1" if place.address == "0.0.0.0" else place.address
    unchecked = ssl._create_unverified_context() if place.certificate else None
    try:
        with urlopen(f"{place.scheme}://{address}:{place.port + 1}/", timeout=2, context=unchecked) as answer:
            return json.load(answer).get("home") == str(desk.home.path)
    except (OSError, ValueError):
        return False
