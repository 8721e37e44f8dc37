"""One robot, whatever folders, processes and signals there are; what happened is read from files alone.

SVAEDC_ROUNDS says how often each is tried; a release asks for 500.
"""

import json
import os
import random
import shutil
import signal
import time
from contextlib import suppress
from pathlib import Path

import pytest

from cluster.errors import UserError
from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval
from cluster.hardware.status import Phase
from tests.workers.host.arm import commands, lines

ROUNDS = int(os.environ.get("SVAEDC_ROUNDS", "6"))
ROOT = Path(__file__).parents[2]
SHARED = ("PYTHONPATH", "ARM_LOG", "ARM_STEPS", "ARM_PACE", "XDG_STATE_HOME")
LAB = """
import os
from workers.hardware.robots import Robot

ARM = Robot(
    "arm", "quadratic-30d", "tests.workers.host.arm:Arm", simulated=True,
    settings={"log": os.environ["ARM_LOG"], "steps": int(os.environ["ARM_STEPS"])},
)
"""


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A folder with the robot of these tests."""
    (tmp_path / "lab_of_chaos.py").write_text(LAB)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{ROOT}")
    monkeypatch.setenv("ARM_LOG", os.fspath(tmp_path / "commands.log"))
    monkeypatch.setenv("ARM_STEPS", "20")
    return tmp_path


def plan_in(folder, home, trials=4):
    identity = identify("lab_of_chaos:ARM", "random", trials, 3, 10, None, Approval.POLICY)
    return CampaignPlan(identity, folder, None, float(os.environ.get("ARM_PACE", "0")), None, home)


def carry_on(folder, home, environment, trials, told):
    """One start command: some trials, or the refusal."""
    os.environ.update(environment)
    import sys

    sys.path[:0] = environment["PYTHONPATH"].split(os.pathsep)
    import cluster.hardware.executor as executor

    executor.PATIENCE_SECONDS = 0.2
    try:
        carried = Executor(plan_in(folder, home))
    except UserError as error:
        told.write_text(str(error))
        return
    phase, count = Phase.READY, 0
    while phase is Phase.READY and count < trials:
        phase, count = carried.advance().phase, count + 1
    carried.close()
    told.write_text(f"went on to {phase}")


def start(processes, folder, lab, home, trials, name):
    environment = {key: os.environ[key] for key in SHARED if key in os.environ}
    arguments = (folder, home, environment, trials, lab / f"told-{name}")
    process = processes.Process(target=carry_on, args=arguments)
    process.start()
    return process


def motions(home):
    """(trial, event) of the ledger, read as text."""
    content = (home / "ledger.jsonl").read_bytes().split(b"\n")[:-1]
    entries = [json.loads(line) for line in content]
    return [
        (entry["facts"]["trial"], entry["event"])
        for entry in entries
        if entry["event"] in ("started", "ended", "broken") and entry["facts"].get("trial")
    ]


def require_one_at_a_time(home):
    """No trial starts twice, and none before the one before it has ended."""
    seen, moving = set(), ""
    for trial, event in motions(home):
        if event == "started":
            assert trial not in seen
            assert not moving
            seen.add(trial)
            moving = trial
        else:
            moving = ""
    return seen


@pytest.mark.chaos
@pytest.mark.parametrize("way", ["copied", "restored", "rolled back", "parallel"])
def test_a_folder_that_is_not_the_robots_own_never_moves_it(processes, lab, way):
    refused = 0
    for number in range(ROUNDS):
        home, one, two = (lab / f"{name}-{number}" for name in ("home", "one", "two"))
        start(processes, one, lab, home, 1, "first").join()
        shutil.copytree(one, two)
        if way != "parallel":
            start(processes, one, lab, home, 1, "second").join()
        if way == "rolled back":
            shutil.rmtree(one)
            shutil.copytree(two, one)
        pair = [start(processes, folder, lab, home, 2, folder.name) for folder in (two, one)]
        for process in pair:
            process.join()
            assert process.exitcode == 0
        told = [(lab / f"told-{folder.name}").read_text() for folder in (one, two)]
        moved = require_one_at_a_time(home)
        assert sum(each.startswith("went on") for each in told) <= 1
        assert all(
            "is held by the campaign in" in each or "never heard of" in each or each.startswith("went on")
            for each in told
        )
        refused += sum(not each.startswith("went on") for each in told)
        assert len(moved) >= (1 if way == "parallel" else 2)
    assert refused >= ROUNDS


@pytest.mark.chaos
@pytest.mark.parametrize("blow", [signal.SIGKILL, signal.SIGSTOP])
def test_a_parent_that_dies_or_stops_at_any_moment_leaves_a_robot_at_rest(processes, lab, monkeypatch, blow):
    monkeypatch.setenv("ARM_STEPS", "5000")
    monkeypatch.setenv("ARM_PACE", "0.01")  # s between two commands: this setup has one step
    rng, hit = random.Random(int(blow)), 0
    for number in range(ROUNDS):
        home, folder, log = (lab / f"{name}-{number}" for name in ("home", "campaign", "log"))
        monkeypatch.setenv("ARM_LOG", os.fspath(log))
        home.mkdir()
        (home / "limits.toml").write_text(f"silence = {SILENCE}\n")
        process = start(processes, folder, lab, home, 1, "told")
        while not commands(log) and process.is_alive():
            time.sleep(0.01)
        time.sleep(rng.uniform(0.0, 0.1))
        host = json.loads((home / "host.json").read_bytes())["pid"]
        os.kill(process.pid, blow)
        struck = time.clock_gettime(time.CLOCK_BOOTTIME)
        longest = 2.0 if blow is signal.SIGKILL else SILENCE + 2.0
        while is_alive(host) and time.clock_gettime(time.CLOCK_BOOTTIME) < struck + longest:
            time.sleep(0.02)
        assert commands(log)[-1] <= struck + longest
        assert lines(log)[-1].split()[1] == "stop"
        if blow is signal.SIGKILL:
            assert not is_alive(host)
        hit += motions(home)[-1][1] == "broken"
        with suppress(ProcessLookupError):
            process.kill()
        process.join()
    assert hit == ROUNDS


SILENCE = 1.0
"""The host stops after so many seconds without a sign of life, as its limits say."""


def is_alive(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except FileNotFoundError:
        return False
    return state != "Z"
