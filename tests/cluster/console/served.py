"""A console that is really served, on loopback, of a campaign that really is there."""

import re
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass
from html import unescape
from pathlib import Path

import requests
import uvicorn

from cluster.console.access import AccessTokens, Role
from cluster.console.app import application
from cluster.console.asking import Console
from cluster.console.desk import Desk
from cluster.console.guards import Guards
from cluster.console.pages import Pages, Stopper
from cluster.console.sessions import Sessions
from cluster.console.stop_service import StopServer
from cluster.hardware import campaign, journal
from cluster.hardware.events import utc_now
from cluster.hardware.executor import Executor
from cluster.hardware.journal import Journal
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval, State
from cluster.hardware.status import Phase

ROBOT = "rehearsal:quadratic-30d"
LEDGER = {"started": True, "measurement": None, "certain": True}


@dataclass(frozen=True)
class Served:
    """Where it is, and who may enter."""

    folder: Path
    home: Path
    url: str
    stop_url: str
    operator: str
    viewer: str

    def browser(self, token: str) -> "Browser":
        return Browser(self, token)

    def program(self, token: str) -> requests.Session:
        session = requests.Session()
        session.headers.update({"Authorization": f"Bearer {token}", "Accept": "application/json"})
        return session

    def events(self):
        with closing(book(self.folder)) as opened:
            return opened.events()

    def states(self) -> list[str]:
        with closing(book(self.folder)) as opened:
            return [str(trial.state) for trial in opened.trials()]


class Browser:
    """A browser as the server sees one: a cookie, an origin, and the hidden fields of each form."""

    def __init__(self, served: Served, token: str) -> None:
        self.served, self.session = served, requests.Session()
        self.session.headers["Origin"] = served.url
        self.session.post(f"{served.url}/enter", {"token": token}, timeout=60).raise_for_status()

    def page(self, path: str = "/") -> str:
        answer = self.session.get(self.served.url + path, timeout=60)
        assert answer.status_code == 200, answer.text
        return answer.text

    def form(self, action: str, path: str = "/") -> dict[str, str]:
        """The hidden fields of the form that goes to an address."""
        [found] = re.findall(
            rf'<form[^>]*action="{re.escape(action)}"[^>]*>(.*?)</form>', self.page(path), re.S
        )
        hidden = re.findall(r'type="hidden" name="(\w+)" value="([^"]*)"', found)
        return {name: unescape(value) for name, value in hidden}

    def send(self, action: str, **fields: str) -> requests.Response:
        return self.session.post(self.served.url + action, fields, timeout=60, allow_redirects=False)


def book(folder: Path) -> Journal:
    return Journal(folder / journal.FILE, utc_now)


def plan_in(folder: Path, trials: int = 3) -> CampaignPlan:
    folder.mkdir(parents=True, exist_ok=True)
    identity = identify(ROBOT, "random", trials, 3, 20, None, Approval.OPERATOR)
    return CampaignPlan(identity, folder, None, 0.0, None, folder.parent / "home")


def awaiting_approval(folder: Path) -> None:
    """A campaign whose first trial waits for a person."""
    with closing(Executor(plan_in(folder))) as executor:
        assert executor.advance().phase is Phase.AWAITS_APPROVAL


def measured(folder: Path) -> None:
    """A campaign whose first trial was measured."""
    from cluster.hardware import operator

    with closing(Executor(plan_in(folder))) as executor:
        executor.advance()
        operator.approve(folder, 0, "Ada")
        executor.advance()


def unknown(folder: Path) -> None:
    """A campaign whose first trial was cut, nobody knows where."""
    awaiting_approval(folder)
    with closing(book(folder)) as opened:
        trial = opened.trial(0)
        for state in (State.APPROVED, State.GRANTED, State.RUNNING):
            trial = campaign.record(opened, trial, state, "test", {})
        campaign.record(opened, trial, State.UNKNOWN, "recovery", {"ledger": LEDGER, "found_by": {}})


@contextmanager
def serving(folder: Path) -> Iterator[Served]:
    """The application behind its guards, and STOP beside it."""
    desk = Desk.of(folder)
    tokens = AccessTokens(desk.home.path)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        host = f"127.0.0.1:{listening.getsockname()[1]}"
        stopping = StopServer(("127.0.0.1", 0), ROBOT, desk.home.path, f"http://{host}/")
        stop_url = f"http://127.0.0.1:{stopping.server_address[1]}/stop"
        console = Console(
            desk, tokens, Pages(desk, Stopper(stop_url, stopping.key)), False, Sessions(), threading.Event()
        )
        guarded = Guards(application(console), [host], "http", stop_url.rpartition("/")[0])
        server = uvicorn.Server(
            uvicorn.Config(guarded, log_level="warning", lifespan="off", timeout_graceful_shutdown=1)
        )
        threads = [
            threading.Thread(target=server.run, kwargs={"sockets": [listening]}),
            threading.Thread(target=stopping.serve_forever),
        ]
        for thread in threads:
            thread.start()
        while not server.started:
            time.sleep(0.01)
        try:
            people = tokens.issue("Ada", Role.OPERATOR), tokens.issue("Vera", Role.VIEWER)
            yield Served(folder, desk.home.path, f"http://{host}", stop_url, *people)
        finally:
            console.closing.set()
            server.should_exit = True
            stopping.shutdown()
            for thread in threads:
                thread.join(30)
            stopping.server_close()
