"""How soon a robot gets its last command after STOP was pressed in the console.

As `benchmarks.stopping`, a hundred commands a second in a real host; but the stop comes as the console's
form, over HTTP to the process that answers STOP: from a program, and from Chromium itself.
"""

import argparse
import os
import random
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlencode
from urllib.request import urlopen

from benchmarks.stopping import ROOT, commands, percentile, running, signal_round_trips, told
from cluster.console.stop_service import KEY, stop_key
from workers.host.guard import now

PAGE = """<!doctype html><form method="post" action="{url}"><input type="hidden" name="key" value="{key}">
<input type="hidden" name="who" value="benchmark"><button>STOP</button></form>"""

SEND = "setTimeout(() => document.forms[0].requestSubmit(), 300); return Date.now() + 300"


def main() -> None:
    """Measure both ways, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=20, help="by each way")
    parser.add_argument("--ways", default="form,browser")
    options = parser.parse_args()
    os.chdir(ROOT)
    bare = signal_round_trips()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, {options.stops} stops by each way")
    print(f"a signal and its answer: {told(bare)}")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name, service(Path(name)) as url:
        for way in options.ways.split(","):
            with WAYS[way](Path(name), url) as press:
                times = [one_stop(Path(name), press) for _ in range(options.stops)]
            print(f"{way}: last command {told(times)}; {percentile(times) / percentile(bare):.1f} x a signal")


@contextmanager
def service(folder: Path) -> Iterator[str]:
    """The process that answers STOP of one robot; its address."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    command = [sys.executable, "-m", "cluster.console.stop_service", "--robot", "desk", "--home", str(folder)]
    command += ["--address", "127.0.0.1", "--port", str(port), "--back", "http://127.0.0.1/"]
    with subprocess.Popen(command) as process, socket.socket() as probe:
        while probe.connect_ex(("127.0.0.1", port)):
            time.sleep(0.05)
        yield f"http://127.0.0.1:{port}/stop"
        process.kill()


def one_stop(folder: Path, press: Callable[[], float]) -> float:
    """Seconds from the press to the last command; the robot's past is forgotten afterwards."""
    with running(folder) as (_, log):
        time.sleep(random.uniform(0.0, 0.02))  # at any moment between two commands
        asked = press()
        time.sleep(0.1)  # for a command that should not come
        after = [moment - asked for moment in commands(log) if moment > asked]
    for path in folder.iterdir():
        if path.name != KEY:
            shutil.rmtree(path) if path.is_dir() else path.unlink()
    return max(after, default=0.0)


@contextmanager
def by_form(folder: Path, url: str) -> Iterator[Callable[[], float]]:
    """A program sends the form."""
    form = urlencode({"key": stop_key(folder), "who": "benchmark"}).encode()

    def press() -> float:
        asked = now()
        urlopen(url, form, timeout=10).close()
        return asked

    yield press


@contextmanager
def by_browser(folder: Path, url: str) -> Iterator[Callable[[], float]]:
    """Chromium presses the button of a page that holds the form."""
    from tests.cluster.console.test_browser import driver

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        page = Path(name) / "page.html"
        page.write_text(PAGE.format(url=url, key=stop_key(folder)), encoding="utf-8")
        browser = driver(Path(name) / "profile")

        def press() -> float:
            """The form is sent by a timer of the page, whose moment is known."""
            wall = browser.execute_script(SEND) / 1e3
            asked = now() + wall - time.time()
            while browser.title != "STOP":
                time.sleep(0.05)
            browser.get(page.as_uri())
            return asked

        browser.get(page.as_uri())
        yield press
        browser.quit()


WAYS = {"form": by_form, "browser": by_browser}

if __name__ == "__main__":
    main()
