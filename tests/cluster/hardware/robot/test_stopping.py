"""A robot is stopped past everything else, and moves again only when a person has seen it."""

import multiprocessing
import os
import signal
import time
from contextlib import suppress

import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware.robot import stopping
from cluster.hardware.robot.account import account
from cluster.hardware.robot.residence import (
    enter,
    home_of,
    home_of_campaign,
    homes_of,
    limits_of,
    robot_errors,
)
from cluster.home import robot_folder
from workers.host.home import RobotHome
from workers.host.latch import Latch

RUN = "asked for"


@pytest.fixture
def home(tmp_path):
    return RobotHome(tmp_path / "home", "desk").make()


def events(home):
    return [(entry.event, entry.facts["who"]) for entry in home.ledger.entries()]


def test_a_stop_holds_until_a_named_person_has_seen_the_robot(home):
    done = stopping.stop("desk", home.path, "Ada", "it smells")
    assert (done.answer.reached, done.killed) == (False, False)
    assert "no host is at the robot, which gets no commands. It stays stopped until: " in done.advice
    assert f"svaedc hardware clear desk --home {home.path} --who NAME" in done.advice
    for who, note in (("", "seen"), ("Ada", " ")):
        with pytest.raises(UsageError, match="cleared by a person who has seen the robot: give --who NAME"):
            stopping.clear("desk", home.path, who, note)
    assert home.latch.is_set
    assert stopping.clear("desk", home.path, "Bob", "a fuse").endswith(": it smells")
    assert stopping.clear("desk", home.path, "Bob", "a fuse") == ""
    assert not home.latch.is_set
    assert events(home) == [("stopped", "Ada"), ("cleared", "Bob")]


def hang(home, ready):
    """A process that has the robot and answers nothing."""
    with home.hold({"campaign": "/campaigns/one", "pid": os.getpid(), "host": "bench"}):
        home.write_host({"pid": os.getpid(), "rest": {"stop": "hold", "kill": os.environ["REST"]}})
        ready.set()
        time.sleep(600)


@pytest.mark.parametrize(
    ("rest", "killed"), [("hold", True), ("sag", True), ("drop", False), ("go on", False)]
)
def test_a_host_that_hangs_is_killed_only_where_that_brings_the_motors_to_rest(
    home, monkeypatch, rest, killed
):
    monkeypatch.setenv("REST", rest)
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    process = context.Process(target=hang, args=(home, ready))
    process.start()
    try:
        assert ready.wait(120)
        os.kill(process.pid, signal.SIGSTOP)
        done = stopping.stop("desk", home.path, "Ada", RUN)
        assert done.killed is killed
        expected = (
            f"was killed; without it its motors {rest}" if killed else "USE THE ROBOT'S OWN EMERGENCY STOP"
        )
        assert expected in done.advice
        if killed:
            process.join(30)
            assert process.exitcode == -signal.SIGKILL
    finally:
        with suppress(ProcessLookupError):
            process.kill()
        process.join()


def test_a_stop_works_though_the_ledger_is_damaged(home):
    home.ledger.append("stopped", {"who": "Ada"})
    home.ledger.path.write_bytes(home.ledger.path.read_bytes().replace(b"Ada", b"Eve"))
    assert "stays stopped" in stopping.stop("desk", home.path, "Ada", RUN).advice
    assert home.latch.is_set


def test_a_latch_that_cannot_be_written_is_told_where_no_host_is_there(home, monkeypatch):
    def full(self, _stop):
        raise OSError(28, "No space left on device", str(self.path))

    monkeypatch.setattr(Latch, "set", full)
    with pytest.raises(
        UserError, match=r"cannot use .*STOPPED: No space left on device; it needs a writable"
    ):
        stopping.stop("desk", home.path, "Ada", RUN)


def test_a_robot_without_a_home_is_refused_by_name(tmp_path):
    for act in (
        lambda: stopping.stop("desk", tmp_path / "no", "Ada", RUN),
        lambda: stopping.clear("d", tmp_path / "no", "A", "n"),
    ):
        with pytest.raises(UserError, match=r"is no robot's home: no campaign of .* was ever begun"):
            act()


def test_the_home_is_shared_where_the_machine_has_one_and_else_the_users(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.setattr("cluster.home.SHARED_STATE", tmp_path / "shared")
    assert (
        robot_folder("rehearsal:my_robot") == tmp_path / "state" / "svaedc" / "robots" / "rehearsal-my_robot"
    )
    (tmp_path / "shared" / "robots" / "arm").mkdir(parents=True)
    assert robot_folder("arm") == tmp_path / "shared" / "robots" / "arm"
    assert home_of("arm", tmp_path / "named").path == tmp_path / "named"


def test_a_campaigns_folder_remembers_the_home(tmp_path):
    (tmp_path / "campaign").mkdir()
    entered = enter(tmp_path / "campaign", "desk", tmp_path / "named")
    assert entered.path.is_dir()
    assert home_of_campaign(tmp_path / "campaign", "desk") == entered


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("speed = 3", r"limits.toml: speed must be a table of limits by joint, got 3"),
        ("[speed", "cannot use the limits of desk: Expected"),
        ("\xff", "cannot use the limits of desk: .*utf-8"),
    ],
)
def test_limits_that_cannot_be_read_are_told_with_their_file(home, text, named):
    home.limits.write_bytes(text.encode("latin-1"))
    with pytest.raises(UserError, match=named):
        limits_of(home, simulated=True)


def test_a_real_robot_needs_limits_and_a_rehearsal_does_not(home):
    assert limits_of(home, simulated=True).facts() == {}
    with pytest.raises(
        UserError, match=r"desk has no limits, and does not move without: write .*limits\.toml"
    ):
        limits_of(home, simulated=False)
    home.limits.write_text('duration = 20\n[speed]\n"*" = 0.5\n')
    assert limits_of(home, simulated=False).duration == 20


def test_trouble_at_a_robot_is_told_in_words(home):
    with (
        home.hold({"campaign": "/c", "pid": 1, "host": "bench"}),
        pytest.raises(UserError, match=r"desk is held by the campaign in /c \(process 1 on bench\): wait"),
        robot_errors(),
        home.hold({}),
    ):
        pass


def test_a_stop_that_names_the_robot_alone_finds_every_home_of_its_campaigns(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    (tmp_path / "campaign").mkdir()
    homes = [enter(tmp_path / "campaign", "desk", tmp_path / name) for name in ("one", "two", "one")]
    usual = home_of("desk", None)
    assert {each.path for each in homes_of("desk", None)} == {usual.path, *(each.path for each in homes)}
    stopping.stop("desk", None, "Ada", RUN)
    assert all(each.latch.is_set for each in homes)
    assert stopping.clear("desk", None, "Bob", "nothing near it").endswith(RUN)
    assert not any(each.latch.is_set for each in homes)
    assert homes_of("desk", tmp_path / "one") == (homes[0],)


def test_what_is_true_of_a_robot_is_told_for_every_home(tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    with pytest.raises(UserError, match="no campaign of 'desk' was ever begun here"):
        list(account("desk", None))
    (tmp_path / "campaign").mkdir()
    home = enter(tmp_path / "campaign", "desk", tmp_path / "one")
    home.ledger.append("started", {"trial": "a"})
    home.ledger.append("ended", {"trial": "a", "commands": 7, "seconds": 2.0, "travel": {"hip": 1.5}})
    stopping.stop("desk", home.path, "Ada", "it smells")
    with home.hold({"campaign": "/campaigns/one", "pid": 7, "host": "bench"}):
        said = "\n".join(account("desk", home.path))
    for words in (
        f"desk: its home is {home.path}",
        "held by the campaign in /campaigns/one (process 7 on bench)",
        "stopped by Ada",
        "moved by 1 trials: 7 commands in 2.0 s of motion",
        "hip",
    ):
        assert words in said
