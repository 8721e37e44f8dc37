"""`kill -9` at every point of the code that is durable, moves the robot or talks: by name, in both processes.

SVAEDC_HITS says how often every point is killed at; a release asks for 30.
"""

import json
import os
import random
import signal
import sys
import time
from collections import Counter
from contextlib import closing, suppress
from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from tests.chaos.crash_points import CALLS, ROOT, points, watch
from tests.chaos.robot_checker import Account, look
from tests.chaos.test_robots import is_alive

HITS = int(os.environ.get("SVAEDC_HITS", "1"))
TRIALS = 6
LONGEST_CAMPAIGN = 40
"""Starts of one campaign; then another one is begun."""
TOLD = 3
"""The exit code of a command that ended with a message for its user."""
HOST = ("workers/host/serve.py", "workers/host/motion.py", "workers/host/recording.py")
BOTH = "workers/host/durable.py"
ARM = """
import os
import threading
from pathlib import Path
from tests.chaos.crash_points import watch
from tests.workers.host.arm import Arm
from workers.host import stop
from workers.host.home import RobotHome
from workers.host.latch import Stop
from workers.host.machine import Fault

class FrailArm(Arm):
    '''What happens at the third command follows from x alone.'''

    def __init__(self, home, **settings):
        super().__init__(**settings)
        self._home = RobotHome(Path(os.environ["ARM_HOME"]), "arm")
        watch(Path(os.environ["POINTS_LOG"]), os.environ["KILL_HOST_AT"])

    def send(self, command):
        super().send(command)
        if self._sent == 3 and self._x[0] < 0.15:
            raise Fault("a motor is hot")
        if self._sent == 3 and self._x[0] < 0.3:
            raise ZeroDivisionError("a division in the driver")
        if self._sent == 3 and self._x[0] < 0.5:
            stop.request(self._home, Stop("Bob", "it smells"), 0.01)
"""
LAB = """
import os
from workers.hardware.robots import Robot

ARM = Robot(
    "arm", "quadratic-30d", "frail_arm:FrailArm", simulated=True,
    settings={"log": os.environ["ARM_LOG"], "steps": 6, "home": ""},
)
"""
LIMITS = "[position]\njoint1 = [-1.0, 0.35]\n"


def carry_on(folder, home, environment, kill_at):
    """The start command, without Ray, until it is killed or a person must act."""
    os.environ.update(environment)
    sys.path[:0] = environment["PYTHONPATH"].split(os.pathsep)
    from cluster.errors import UserError
    from cluster.hardware.executor import Executor
    from cluster.hardware.plan import CampaignPlan, identify
    from cluster.hardware.record.first_trials import FirstTrial
    from cluster.hardware.states import Approval, State
    from cluster.hardware.status import Phase

    watch(Path(environment["POINTS_LOG"]), kill_at)
    shared = FirstTrial("another", 0, "00" * 240, 0.5, 0.25)
    first = (shared, replace(shared, number=1)) if int(folder.name[-1]) % 2 else ()
    seed = 100 + int(folder.name.rpartition("-")[2])
    identity = identify(ROBOT, "random", TRIALS - 2, seed, 10, None, Approval.POLICY, None, 0.0, first)
    plan = CampaignPlan(identity, folder, None, 0.0, None, home, first)
    try:
        with closing(Executor(plan)) as executor:
            now = executor.status()
            while now.phase is Phase.READY:
                now = executor.advance()
                if now.trials[-1].state in (State.FAILED, State.ABORTED):
                    break  # the command asks a person to see to it
    except UserError:
        sys.exit(TOLD)


def decide(folder, home, environment, number, stops):
    """A person who has seen the robot: they say what became of a trial, and let the robot move again."""
    os.environ.update(environment)
    sys.path[:0] = environment["PYTHONPATH"].split(os.pathsep)
    from cluster.hardware import operator
    from cluster.hardware.robot import stopping
    from workers.hardware.records import motion_in
    from workers.host.home import RobotHome

    if stops:
        stopping.stop(ROBOT, home, "Bob", "for a look")
    stopping.clear(ROBOT, home, "Ada", "nothing near it")
    if number is None:
        return
    name = operator.status(folder).name
    found = motion_in(RobotHome(home, ROBOT).ledger, f"{name}-{number:03d}").measurement
    if found is None:
        operator.resolve(folder, number, "failed", "Ada", "it stands still", None, None)
    else:
        operator.resolve(folder, number, "measured", "Ada", "seen", found.f, found.y, found.f)


@pytest.fixture
def lab(tmp_path, monkeypatch):
    (tmp_path / "lab_of_points.py").write_text(LAB)
    (tmp_path / "frail_arm.py").write_text(ARM)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{ROOT}")
    monkeypatch.setenv("POINTS_LOG", os.fspath(tmp_path / "points.log"))
    monkeypatch.setenv("KILL_HOST_AT", "")
    monkeypatch.setenv("ARM_LOG", os.fspath(tmp_path / "commands.log"))
    return tmp_path


ROBOT = "lab_of_points:ARM"
SHARED = ("ARM_HOME", "PYTHONPATH", "POINTS_LOG", "KILL_HOST_AT", "ARM_LOG", "XDG_STATE_HOME")


def run(processes, work, *arguments):
    process = processes.Process(target=work, args=arguments)
    process.start()
    process.join()
    return process.exitcode


def end_host(home):
    """No host outlives whoever drives it by more than a moment."""
    with suppress(OSError, ValueError):
        pid = json.loads((home / "host.json").read_bytes())["pid"]
        deadline = time.monotonic() + 30
        while is_alive(pid):
            assert time.monotonic() < deadline, "an orphan is at the robot"
            time.sleep(0.01)


@dataclass(frozen=True)
class Blow:
    """Where a start is to die.

    Attributes:
        point: of `points`; "" for nowhere.
        hit: how often it is passed before.
        in_host: whether the host dies there, and not its parent.
        stops: whether somebody stops the robot afterwards.
    """

    point: str = ""
    hit: int = 0
    in_host: bool = False
    stops: bool = False

    @classmethod
    def drawn(cls, rng, left):
        """One of the points that are left."""
        point = rng.choice(sorted(left))
        in_host = point.startswith(HOST) or (point.startswith(BOTH) and rng.random() < 0.5)
        return cls(point, rng.choice((0, 0, 0, 1, 2)), in_host, rng.random() < 0.2)

    def __str__(self):
        return f"{self.point},{self.hit}" if self.point else ""


def one_start(processes, folder, home, blow):
    """One start that is to die at a point, and what a person must do then; the account of all files."""
    home.mkdir(exist_ok=True)
    (home / "limits.toml").write_text(LIMITS)
    os.environ["KILL_HOST_AT"] = str(blow) if blow.in_host else ""
    os.environ["ARM_LOG"] = os.fspath(home.with_suffix(".log"))
    os.environ["ARM_HOME"] = os.fspath(home)
    environment = {key: os.environ[key] for key in SHARED if key in os.environ}
    code = run(processes, carry_on, folder, home, environment, "" if blow.in_host else str(blow))
    assert code in (0, TOLD, -signal.SIGKILL)
    end_host(home)
    account = look(folder, home, home.with_suffix(".log"))
    unknown = next((number for number, state in account.states.items() if state == "unknown"), None)
    if unknown is None and not blow.stops and not (home / "STOPPED").exists():
        return account
    assert run(processes, decide, folder, home, environment, unknown, blow.stops) == 0
    return look(folder, home, home.with_suffix(".log"))


@pytest.mark.chaos
def test_a_kill_at_any_point_loses_nothing_and_repeats_nothing(processes, lab):
    rng = random.Random(0)
    left = Counter({point: HITS for point in points()})
    lapsing = Blow(place("campaign.py", "State.APPROVED, who"), stops=True)
    campaign, starts, kills, before = 0, 0, 0, Account()
    while left:
        folder, home = lab / f"campaign-{campaign}", lab / f"home-{campaign}"
        blow, seen = Blow.drawn(rng, left), size(lab)
        if rng.random() < 0.1:
            one_start(processes, folder, home, lapsing)  # some points are passed after such a death only
        account = one_start(processes, folder, home, blow)
        assert account.faults == []
        assert before.measured.items() <= account.measured.items()
        if lines_since(lab, seen)[blow.point] > blow.hit:
            kills += 1
            left -= Counter([blow.point])
            some = ", ".join(sorted(left)[:6])
            print(f"{kills} kills in {campaign + 1} campaigns, {left.total()} to come: {some}", flush=True)
        before, starts = account, starts + 1
        # Some points are passed at the beginning of a campaign only.
        if starts >= LONGEST_CAMPAIGN or len(account.measured) >= TRIALS or rng.random() < 0.1:
            campaign, starts, before = campaign + 1, 0, Account()


def size(lab):
    return (lab / "points.log").stat().st_size if (lab / "points.log").exists() else 0


def lines_since(lab, offset):
    with (lab / "points.log").open("rb") as file:
        file.seek(offset)
        return Counter(file.read().decode().splitlines())


@pytest.mark.chaos
def test_every_point_is_passed_by_a_campaign(processes, lab):
    lapsing = Blow(place("campaign.py", "State.APPROVED, who"), stops=True)
    for number in range(4):
        for blow in (Blow(), Blow(place("campaign.py", "State.RUNNING, ")), lapsing, Blow(), Blow()):
            one_start(processes, lab / f"campaign-{number}", lab / f"home-{number}", blow)
    passed = lines_since(lab, 0)
    assert [point for point in points() if not passed[point]] == []


def place(file, words):
    """The point behind the first line of a file that has these words."""
    name = next(name for name in CALLS if name.endswith(file))
    lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
    return next(f"{name}:{number} after" for number, line in enumerate(lines, start=1) if words in line)
