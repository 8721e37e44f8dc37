"""How soon a robot gets its last command after a stop was asked for, in several states around it.

An arm that moves nothing, told a command a hundred times a second, in a real host. The last command is
what the arm wrote down, on the clock that all processes share. A bare signal's way from one process to
another and back, measured in the same run, says how busy the machine is.
"""

import argparse
import os
import random
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from pathlib import Path

import numpy as np

from workers.hardware.driver import RobotFault
from workers.hardware.host_process import Machinery
from workers.hardware.hosted import HostedRobot
from workers.host import stop
from workers.host.guard import now
from workers.host.home import RobotHome
from workers.host.latch import Stop
from workers.host.limits import RobotLimits

ROOT = Path(__file__).parents[1]
MACHINE = "tests.workers.host.arm:Arm"
X = np.array([0.25, 0.75])
STEPS = 2000
SIGNALS = 200


def main() -> None:
    """Measure every state, and print a line for each."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--stops", type=int, default=20, help="in each state")
    parser.add_argument("--states", default=",".join(STATES))
    options = parser.parse_args()
    os.chdir(ROOT)
    bare = signal_round_trips()
    print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores, {options.stops} stops in each state")
    print(f"a signal and its answer: {told(bare)}")
    for state in options.states.split(","):
        times = [one_stop(state) for _ in range(options.stops)]
        print(f"{state}: last command {told(times)}; {percentile(times) / percentile(bare):.1f} x a signal")


def told(seconds: list[float]) -> str:
    """Median, 99th percentile and maximum, in ms."""
    median = statistics.median(seconds) * 1e3
    return f"median {median:.2f} ms, p99 {percentile(seconds) * 1e3:.2f} ms, max {max(seconds) * 1e3:.2f} ms"


def percentile(seconds: list[float]) -> float:
    """The 99th."""
    return sorted(seconds)[min(len(seconds) - 1, int(0.99 * len(seconds)))]


def one_stop(state: str) -> float:
    """Seconds from the request to the last command; 0 where none came after it."""
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name,
        STATES[state](Path(name)) as (home, log),
    ):
        time.sleep(random.uniform(0.0, 0.02))  # at any moment between two commands
        asked = now()
        stop.request(home, Stop("benchmark", state))
        time.sleep(0.1)  # for a command that should not come
        sent = [moment for moment in commands(log) if moment > asked]
        return max([moment - asked for moment in sent], default=0.0)


def commands(log: Path) -> list[float]:
    """When each command was sent."""
    with suppress(FileNotFoundError):
        rows = [line.split() for line in log.read_text(encoding="utf-8").splitlines()]
        return [float(row[0]) for row in rows if row[1] == "command"]
    return []


@contextmanager
def robot_in(folder: Path) -> Iterator[tuple[HostedRobot, Path]]:
    """A robot behind its host."""
    log = folder / "commands.log"
    machinery = Machinery(MACHINE, sys.executable, {"log": str(log), "steps": STEPS})
    robot = HostedRobot("desk", "desk", RobotHome(folder, "desk").make(), machinery, RobotLimits())
    robot.check("first", X)
    yield robot, log
    robot.stop()


@contextmanager
def idle(folder: Path) -> Iterator[tuple[RobotHome, Path]]:
    """A host that waits for its first trial."""
    with robot_in(folder) as (robot, log):
        yield robot.home, log


@contextmanager
def granted(folder: Path) -> Iterator[tuple[RobotHome, Path]]:
    """A trial was granted a moment ago, and is run a moment after the stop: it must not send a command."""
    with robot_in(folder) as (robot, log):
        yield robot.home, log
        run_through(robot)
        if commands(log):
            raise AssertionError(f"{len(commands(log))} commands were sent to a stopped robot")


@contextmanager
def running(folder: Path) -> Iterator[tuple[RobotHome, Path]]:
    """A host in the middle of a motion."""
    with robot_in(folder) as (robot, log):
        thread = threading.Thread(target=run_through, args=(robot,))
        thread.start()
        while len(commands(log)) < 5:
            time.sleep(0.002)
        yield robot.home, log
        thread.join()


@contextmanager
def without_socket(folder: Path) -> Iterator[tuple[RobotHome, Path]]:
    """A motion whose host cannot be reached, but by the latch."""
    with running(folder) as (home, log):
        home.socket.unlink()
        yield home, log


@contextmanager
def driver_stopped(folder: Path) -> Iterator[tuple[RobotHome, Path]]:
    """A motion whose driving process was stopped by SIGSTOP a moment ago."""
    with driving_process(folder, "") as (process, log):
        process.send_signal(signal.SIGSTOP)
        yield RobotHome(folder, "desk"), log


@contextmanager
def driver_busy(folder: Path) -> Iterator[tuple[RobotHome, Path]]:
    """A motion whose driving process computes something else all the while, as an actor in a long call."""
    spin = "threading.Thread(target=lambda: [sum(range(1000)) for _ in iter(int, 1)], daemon=True).start()"
    with driving_process(folder, spin) as (_, log):
        yield RobotHome(folder, "desk"), log


@contextmanager
def driving_process(folder: Path, before: str) -> Iterator[tuple[subprocess.Popen[bytes], Path]]:
    """Another process in the middle of a motion."""
    log = folder / "commands.log"
    script = (
        "import sys, threading; sys.path.insert(0, '.')\n"
        "from benchmarks.stopping import robot_in, run_through\nfrom pathlib import Path\n"
        f"{before}\n"
        f"with robot_in(Path({str(folder)!r})) as (robot, _): run_through(robot)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", script], cwd=ROOT)
    while len(commands(log)) < 5:
        time.sleep(0.002)
    try:
        yield process, log
    finally:
        process.kill()
        process.wait()
        time.sleep(0.5)  # for the host to notice, and to leave


STATES: dict[str, Callable[[Path], AbstractContextManager[tuple[RobotHome, Path]]]] = {
    "idle": idle,
    "granted": granted,
    "running": running,
    "driver-busy": driver_busy,
    "without-socket": without_socket,
    "driver-stopped": driver_stopped,
}


def run_through(robot: HostedRobot) -> None:
    """Run a trial that will be stopped."""
    with suppress(RobotFault):
        robot.run("first", X)


def signal_round_trips() -> list[float]:
    """Seconds of a signal to another process, and of its signal back."""
    answered = threading.Event()
    signal.signal(signal.SIGUSR1, lambda *_: answered.set())
    script = (
        "import os, signal\n"
        "signal.signal(signal.SIGUSR1, lambda *_: os.kill(os.getppid(), signal.SIGUSR1))\n"
        "print('ready', flush=True)\nwhile True: signal.pause()\n"
    )
    process = subprocess.Popen([sys.executable, "-S", "-c", script], stdout=subprocess.PIPE)
    if process.stdout is not None:
        process.stdout.readline()
    times = []
    for _ in range(SIGNALS):
        answered.clear()
        begin = time.monotonic()
        process.send_signal(signal.SIGUSR1)
        while not answered.is_set():
            time.sleep(0)
        times.append(time.monotonic() - begin)
    process.kill()
    process.wait()
    return times


if __name__ == "__main__":
    main()
