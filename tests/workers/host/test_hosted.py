"""One motion at a time, in a process that comes to rest whatever happens around it; all of them real."""

import multiprocessing
import os
import re
import signal
import sys
import threading
import time

import numpy as np
import pytest

from tests.workers.host.arm import PERIOD, STEPS, commands, lines
from tests.workers.host.conftest import X
from workers.hardware.driver import RobotBroke, RobotFault, RobotStopped
from workers.host import stop
from workers.host.guard import SILENCE_SECONDS, now
from workers.host.home import RobotHeld
from workers.host.latch import Stop

ADA = Stop("Ada", "it smells")


def events(home):
    return [(entry.event, entry.facts.get("trial")) for entry in home.ledger.entries()]


def in_background(run, *arguments):
    """A thread that runs, and the list that its outcome will be in."""
    outcome = []

    def keep():
        try:
            outcome.append(run(*arguments))
        except RobotFault as error:
            outcome.append(error)

    thread = threading.Thread(target=keep)
    thread.start()
    return thread, outcome


def wait_for(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end, "waited in vain"
        time.sleep(0.005)


def test_a_motion_runs_at_the_robots_rate_and_the_ledger_knows_before_and_after(arm, home, log):
    robot = arm()
    measured = robot.run("desk-0", X)
    assert (measured.f, measured.y) == (1.0, 0.25)
    sent = commands(log)
    assert len(sent) == STEPS
    assert sent[-1] - sent[0] >= (STEPS - 2) * PERIOD
    assert events(home) == [("started", "desk-0"), ("ended", "desk-0")]
    assert robot.motion("desk-0").measurement.f == 1.0
    assert not robot.motion("desk-1").started
    assert robot.hello["rest"] == {"stop": "hold", "kill": "sag", "silence": "go on", "disconnect": "drop"}


def test_a_python_without_any_library_serves_as_well(arm, home, log, tmp_path):
    bare = tmp_path / "python"
    bare.write_text(f'#!/bin/sh\nexec {sys.executable} -S -E "$@"\n')
    bare.chmod(0o700)
    assert arm(python=os.fspath(bare), period=0.0).run("desk-0", X).f == 1.0
    assert len(commands(log)) == STEPS
    assert home.log.read_text() == ""


def test_a_known_trial_does_not_move_the_robot_again(arm, home, log):
    arm(period=0.0).run("desk-0", X)
    with pytest.raises(RobotStopped, match="desk-0 has already moved the robot according to"):
        arm(period=0.0).run("desk-0", X)
    assert len(commands(log)) == STEPS
    assert events(home) == [("started", "desk-0"), ("ended", "desk-0")]


def test_a_stop_reaches_a_motion_at_once_and_holds_until_it_is_cleared(arm, home, log):
    robot = arm(period=0.05)
    thread, outcome = in_background(robot.run, "desk-0", X)
    wait_for(lambda: len(commands(log)) > 3)
    asked = now()
    answer = stop.request(home, ADA)
    thread.join()
    assert answer.reached
    assert answer.moving
    assert answer.at_rest
    assert answer.rest == "hold"
    assert answer.last_command == pytest.approx(commands(log)[-1], abs=0.05)
    assert commands(log)[-1] <= asked + 0.2
    assert "stop" in lines(log)[-1]
    assert isinstance(outcome[0], RobotStopped)
    assert re.search(r"stopped by Ada at .*: it smells", str(outcome[0]))
    assert events(home) == [("started", "desk-0"), ("broken", "desk-0")]
    count = len(commands(log))
    with pytest.raises(RobotStopped, match="stopped by Ada"):
        robot.run("desk-1", X)
    assert len(commands(log)) == count
    home.latch.clear()
    assert robot.run("desk-1", X).f == 1.0


def test_the_latch_alone_stops_where_the_socket_is_gone(arm, home, log):
    robot = arm(period=0.05)
    thread, outcome = in_background(robot.run, "desk-0", X)
    wait_for(lambda: len(commands(log)) > 3)
    home.socket.unlink()
    assert not stop.request(home, ADA).reached
    thread.join()
    assert "stopped by Ada" in str(outcome[0])
    assert len(commands(log)) < STEPS


def test_a_stop_wakes_a_driver_that_hangs_in_a_command(arm, home, log):
    robot = arm("hangs", period=0.0)
    thread, outcome = in_background(robot.run, "desk-0", X)
    wait_for(lambda: len(commands(log)) == 10)
    assert stop.request(home, ADA).reached
    thread.join()
    assert "woken by a stop" in str(outcome[0])


def test_a_driver_that_never_returns_costs_its_process_and_leaves_an_unknown(arm, home, log):
    robot = arm("hangs for ever", period=0.0)
    thread, outcome = in_background(robot.run, "desk-0", X)
    wait_for(lambda: len(commands(log)) == 10)
    stop.request(home, ADA)
    thread.join()
    assert isinstance(outcome[0], RobotBroke)
    assert "is gone (exit status 4" in str(outcome[0])
    assert "without it its motors sag" in str(outcome[0])


@pytest.mark.parametrize(
    ("trouble", "error", "named"),
    [
        ("raises", RobotBroke, r"ZeroDivisionError: a division in the driver \(arm.py, line \d+\)"),
        ("fault", RobotFault, "a motor is hot"),
        ("beyond", RobotStopped, r"step 10: the position of joint2 must lie in \[-1, 1\], got 9"),
        ("nan", RobotStopped, "step 10: joint1 must be a finite number, got nan"),
        ("dies", RobotBroke, "is gone .exit status 9"),
    ],
)
def test_trouble_in_motion_is_told_by_its_cause(arm, home, log, trouble, error, named):
    robot = arm(trouble, limits={"position": {"*": [-1, 1]}}, period=0.0)
    with pytest.raises(error, match=named) as raised:
        robot.run("desk-0", X)
    assert raised.type is error
    assert len(commands(log)) == 10
    assert events(home)[0] == ("started", "desk-0")
    assert robot.motion("desk-0").started


def test_a_robot_that_cannot_be_stopped_is_never_called_at_rest(arm):
    with pytest.raises(RobotBroke, match="the driver's stop failed: OSError: the bus is gone"):
        arm("cannot stop", limits={"position": {"*": [-1, 1]}}, period=0.0).run("desk-0", X)


def test_a_plan_beyond_the_limits_never_starts(arm, home, log):
    robot = arm(limits={"position": {"joint2": [-0.2, 0.2]}, "duration": 60})
    planned = robot.check("desk-0", X)
    assert planned.objection.startswith("step 27: the position of joint2 must lie in [-0.2, 0.2]")
    with pytest.raises(RobotFault, match="was not started: step 27"):
        robot.run("desk-0", X)
    assert commands(log) == []
    assert events(home) == []
    assert "takes 0.5" in arm(limits={"duration": 0.3}).check("desk-0", X).objection
    fine = arm(limits={"duration": 0.6}).check("desk-0", X)
    assert (fine.objection, fine.steps, fine.seconds) == ("", STEPS, 0.5)
    assert [channel["high"] for channel in fine.channels] == pytest.approx([0.1225, 0.3675])


def test_no_command_comes_after_the_deadline(arm, log):
    robot = arm(limits={"duration": 0.5}, period=0.05)
    began = now()
    with pytest.raises(RobotStopped, match="the trial's time is over"):
        robot.run("desk-0", X)
    assert commands(log)[-1] - commands(log)[0] <= 0.5
    assert now() - began < 20


def test_what_a_driver_prints_is_no_answer_and_is_kept(arm, home):
    assert arm("prints", period=0.0).run("desk-0", X).f == 1.0
    assert "noise of a library" in home.log.read_text()


def test_a_host_that_does_not_start_says_why(arm):
    for settings, named in (
        ({"trouble": "absent"}, "OSError: no arm at /dev/ttyUSB0"),
        ({"python": "/nowhere/python"}, "cannot start the process at desk with /nowhere/python"),
        ({"kill": "explode"}, "must declare what its motors do after kill, one of hold, sag"),
    ):
        with pytest.raises(RobotFault, match=named):
            arm(**settings).check("desk-0", X)


def drive(home, log, ready):
    """A process that drives a host, until it is stopped or killed."""
    os.chdir(os.environ["SVAEDC_TEST_ROOT"])
    from workers.hardware.host_process import Machinery
    from workers.hardware.hosted import HostedRobot
    from workers.host.limits import RobotLimits

    machinery = Machinery(
        "tests.workers.host.arm:Arm", sys.executable, {"log": os.fspath(log), "steps": 4000}
    )
    robot = HostedRobot("desk", "desk", home, machinery, RobotLimits(), 0.01)
    robot.check("desk-0", X)
    ready.set()
    try:
        robot.run("desk-0", X)
    except RobotStopped as error:
        log.with_suffix(".told").write_text(str(error))


@pytest.fixture
def driven(home, log, monkeypatch):
    monkeypatch.setenv("SVAEDC_TEST_ROOT", os.getcwd())  # noqa: PTH109
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    process = context.Process(target=drive, args=(home, log, ready))
    process.start()
    assert ready.wait(120)
    wait_for(lambda: len(commands(log)) > 3)
    yield process
    if process.is_alive():
        process.kill()
    process.join()


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    with open(f"/proc/{pid}/stat") as file:  # noqa: PTH123
        return file.read().rpartition(")")[2].split()[0] != "Z"


def test_a_parent_that_is_stopped_gets_no_further_command_after_a_second(driven, home, log):
    os.kill(driven.pid, signal.SIGSTOP)
    asked = now()
    wait_for(lambda: "stop" in lines(log)[-1])
    assert commands(log)[-1] <= asked + SILENCE_SECONDS + 0.5
    os.kill(driven.pid, signal.SIGCONT)
    wait_for(lambda: log.with_suffix(".told").exists())
    assert "no sign of life from the process that drives the host" in log.with_suffix(".told").read_text()
    assert events(home)[-1] == ("broken", "desk-0")


def test_a_parent_that_is_killed_leaves_the_robot_at_rest_and_no_orphan(driven, home, log):
    host = home.read_host()["pid"]
    assert is_alive(host)
    os.kill(driven.pid, signal.SIGKILL)
    asked = now()
    wait_for(lambda: not is_alive(host), seconds=5)
    assert "stop" in lines(log)[-1]
    assert commands(log)[-1] <= asked + 0.5
    assert events(home) == [("started", "desk-0"), ("broken", "desk-0")]


def test_a_home_serves_one_at_a_time_and_says_whom(home):
    holder = {"campaign": "/campaigns/one", "pid": 7, "host": "bench"}
    assert home.holder() == ""
    with home.hold(holder):
        assert home.holder() == "the campaign in /campaigns/one (process 7 on bench)"
        with (
            pytest.raises(RobotHeld, match=r"desk is held by the campaign in /campaigns/one \(process 7"),
            home.hold({}),
        ):
            pass
    assert home.holder() == ""


def test_a_stop_that_meets_no_host_is_latched_all_the_same(arm, home, log):
    assert not stop.request(home, ADA).reached
    assert str(home.latch.read()).startswith("stopped by Ada at ")
    with pytest.raises(RobotStopped, match="it smells"):
        arm(period=0.0).run("desk-0", X)
    home.latch.path.write_bytes(b"\xff\x00")
    with pytest.raises(RobotStopped, match="cannot be read"):
        arm(period=0.0).run("desk-1", X)
    assert commands(log) == []


def test_messages_that_cannot_be_read_are_refused_and_nothing_moves(arm, log):
    robot = arm(period=0.0)
    robot.check("desk-0", X)
    host = robot._host
    for line in (b"nonsense\n", b"[1]\n", b"{}\n", b'{"do":"run","x":"00"}\n', b'{"do":"dance","x":""}\n'):
        host._process.stdin.write(line)
        host._process.stdin.flush()
        assert host.listen(60.0)["say"] == "refused"
    for x in (np.array([2.0, 0.0]), np.array([np.nan, 0.0])):
        with pytest.raises(RobotFault, match=r"every parameter of x must lie in \[0, 1\]"):
            robot.check("desk-0", x)
    assert commands(log) == []


@pytest.mark.parametrize(
    ("trouble", "named"),
    [("measures nothing", "f must be finite, got nan"), ("measures badly", r"y must lie in \[0, 1\], got 7")],
)
def test_what_is_no_measurement_is_never_in_the_ledger_as_one(arm, home, trouble, named):
    robot = arm(trouble, period=0.0)
    with pytest.raises(RobotBroke, match=named):
        robot.run("desk-0", X)
    assert events(home) == [("started", "desk-0"), ("broken", "desk-0")]
    assert robot.motion("desk-0").measurement is None


@pytest.mark.slow
@pytest.mark.parametrize(("kill", "survives"), [("sag", False), ("drop", True)])
def test_a_host_that_does_not_answer_is_not_waited_for_for_ever(arm, home, log, monkeypatch, kill, survives):
    robot = arm(period=0.05, kill=kill)
    robot.check("desk-0", X)
    monkeypatch.setattr("workers.hardware.hosted._PATIENCE_SECONDS", 4.0)
    thread, outcome = in_background(robot.run, "desk-0", X)
    wait_for(lambda: len(commands(log)) > 3)
    host = home.read_host()["pid"]
    os.kill(host, signal.SIGSTOP)
    thread.join()
    assert isinstance(outcome[0], RobotBroke)
    assert re.search(rf"is gone \(.*no answer for \d+ s\).*; without it its motors {kill}", str(outcome[0]))
    assert is_alive(host) is survives
    if survives:
        os.kill(host, signal.SIGKILL)


def test_a_motion_that_the_ledger_cannot_take_is_unknown_and_never_called_unmoved(arm, home, log):
    robot = arm("fills the disk", period=0.0, ledger=os.fspath(home.ledger.path))
    with pytest.raises(RobotBroke, match="and the ledger could not be written"):
        robot.run("desk-0", X)
    assert len(commands(log)) == STEPS


def test_a_stop_that_the_driver_cannot_follow_is_not_called_rest(arm, home, log):
    robot = arm("cannot stop", at=2000, steps=2000)
    thread, outcome = in_background(robot.run, "desk-0", X)
    wait_for(lambda: len(commands(log)) > 3)
    answer = stop.request(home, ADA)
    thread.join()
    assert (answer.reached, answer.at_rest) == (True, False)
    assert isinstance(outcome[0], RobotBroke)
