"""Twenty things that go wrong at a robot, provoked one by one: each is told by its right cause, in words.

All of it is real but for the arm, which moves nothing: the processes, the locks, the disks, the signals.
"""

import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware import journal, operator
from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.record.attachments import LIST, attach, attachments
from cluster.hardware.robot import stopping
from cluster.hardware.states import Approval
from cluster.hardware.status import Phase

ROOT = Path(__file__).parents[3]
ROBOT = "lab_that_breaks:ARM"
LAB = """
import os
from workers.hardware.robots import Robot

ARM = Robot(
    "arm", "quadratic-30d", "tests.workers.host.arm:Arm", python=os.environ["LAB_PYTHON"], simulated=True,
    settings={"log": os.environ["ARM_LOG"], "trouble": os.environ["TROUBLE"], "at": 3, "steps": 6},
)
REAL = Robot("arm", "quadratic-30d", "tests.workers.host.arm:Arm", settings={"log": os.environ["ARM_LOG"]})
"""


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """The folder of everything; its arm has the trouble that TROUBLE names."""
    (tmp_path / "lab_that_breaks.py").write_text(LAB)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}{os.pathsep}{ROOT}")
    monkeypatch.setenv("ARM_LOG", os.fspath(tmp_path / "commands.log"))
    monkeypatch.setenv("LAB_PYTHON", sys.executable)
    monkeypatch.setenv("TROUBLE", "")
    monkeypatch.setattr("cluster.hardware.executor.PATIENCE_SECONDS", 0.2)
    monkeypatch.delitem(sys.modules, "lab_that_breaks", raising=False)
    return tmp_path


def plan_in(lab, name="campaign", approval=Approval.POLICY, robot=ROBOT):
    identity = identify(robot, "random", 0, 3, 10, None, approval)
    return CampaignPlan(identity, lab / name, None, 0.0, None, lab / "home")


def carried_out(plan):
    """What the person is told at the end: a message, or the advice of the status."""
    try:
        executor = Executor(plan)
    except UserError as error:
        return str(error)
    try:
        now = executor.status()
        for _ in range(4):
            if now.phase is not Phase.READY:
                break
            now = executor.advance()
            if str(now.trials[-1].state) in ("failed", "aborted", "rejected"):
                break
    except UserError as error:
        return str(error)
    finally:
        executor.close()
    return now.advice


def troubled(trouble):
    def provoke(lab, monkeypatch):
        monkeypatch.setenv("TROUBLE", trouble)
        return carried_out(plan_in(lab))

    return provoke


def no_python(lab, monkeypatch):
    monkeypatch.setenv("LAB_PYTHON", "/opt/lab/bin/python")
    return carried_out(plan_in(lab))


def no_module(lab, _):
    (lab / "lab_that_breaks.py").write_text(LAB.replace("tests.workers.host.arm:Arm", "arm_of_nobody:Arm"))
    return carried_out(plan_in(lab))


def limits_that_reject(lab, _):
    (lab / "home").mkdir()
    (lab / "home" / "limits.toml").write_text("[position]\njoint1 = [-0.001, 0.001]\n")
    return carried_out(plan_in(lab))


def limits_that_are_none(lab, _):
    (lab / "home").mkdir()
    (lab / "home" / "limits.toml").write_text("[positoin]\njoint1 = [-1, 1]\n")
    return carried_out(plan_in(lab))


def a_real_robot_without_limits(lab, _):
    return carried_out(plan_in(lab, approval=Approval.OPERATOR, robot="lab_that_breaks:REAL"))


def a_robot_that_somebody_has(lab, _):
    other = Executor(plan_in(lab, "other"))
    try:
        return carried_out(plan_in(lab))
    finally:
        other.close()


def a_copied_folder(lab, _):
    executor = Executor(plan_in(lab))
    executor.advance()
    executor.close()
    shutil.copytree(lab / "campaign", lab / "copy")
    carried_out(plan_in(lab))
    return carried_out(plan_in(lab, "copy"))


def another_home(lab, _):
    carried_out(plan_in(lab))
    return carried_out(replace(plan_in(lab), home=lab / "home of another"))


def a_stopped_robot(lab, _):
    carried_out(plan_in(lab, "before"))
    stopping.stop(ROBOT, lab / "home", "Bob", "it smells")
    return carried_out(plan_in(lab))


def a_latch_that_cannot_be_read(lab, _):
    carried_out(plan_in(lab, "before"))
    (lab / "home" / "STOPPED").write_bytes(b"\xff\xfe")
    return carried_out(plan_in(lab))


def a_damaged_ledger(lab, _):
    carried_out(plan_in(lab, "before"))
    path = lab / "home" / "ledger.jsonl"
    path.write_bytes(path.read_bytes().replace(b"started", b"startle", 1))
    return carried_out(plan_in(lab))


def a_damaged_journal(lab, _):
    carried_out(plan_in(lab))
    path = lab / "campaign" / journal.FILE
    path.write_bytes(path.read_bytes()[:5000] + b"?" * 4000)
    return carried_out(plan_in(lab))


def damaged_attachments(lab, _):
    carried_out(plan_in(lab))
    (lab / "note.txt").write_text("seen")
    attach(lab / "campaign", 0, lab / "note.txt", "Ada", "")
    path = lab / "campaign" / LIST
    path.write_bytes(path.read_bytes().replace(b"Ada", b"Eve"))
    try:
        return str(attachments(lab / "campaign"))
    except UserError as error:
        return str(error)


def a_full_disk(lab, _):
    small = lab / "small"
    small.mkdir()
    if subprocess.run(["mount", "-t", "tmpfs", "-o", "size=96k", "tmpfs", small], check=False).returncode:
        pytest.skip("only root may mount a small file system")
    try:
        return carried_out(plan_in(small, "campaign"))
    finally:
        subprocess.run(["umount", small], check=True)


def limits_that_change_after_the_approval(lab, _):
    plan = plan_in(lab, approval=Approval.OPERATOR)
    carried_out(plan)
    operator.approve(plan.folder, 0, "Ada")
    (lab / "home" / "limits.toml").write_text("duration = 30\n")
    carried_out(plan)
    with operator.opening.to_read(plan.folder) as opened:
        return opened.last_event(0).body


def a_robot_that_must_rest(lab, _):
    (lab / "home").mkdir()
    (lab / "home" / "limits.toml").write_text("rest = 3600\n")
    return carried_out(plan_in(lab))


def a_wrong_number(lab, _):
    carried_out(plan_in(lab))
    try:
        operator.amend(lab / "campaign", 0, "Ada", "typed by hand", f=1e308, y=0.5)
    except UsageError as error:
        return str(error)
    return ""


def an_approval_by_nobody(lab, _):
    carried_out(plan_in(lab, approval=Approval.OPERATOR))
    try:
        operator.approve(lab / "campaign", 0, " ")
    except UsageError as error:
        return str(error)
    return ""


def a_trial_that_waits(lab, _):
    return carried_out(plan_in(lab, approval=Approval.OPERATOR))


PROVOKED = {
    "the driver raises": (
        troubled("raises"),
        r"trial 0 may have moved the robot.*ZeroDivisionError: a division in",
    ),
    "the driver's process dies": (troubled("dies"), r"is gone \(exit status 9.*without it its motors sag"),
    "the driver hangs": (troubled("hangs for ever"), r"trial 0 may have moved the robot: .*is gone"),
    "the robot reports a fault": (troubled("fault"), "trial 0 was failed: .*a motor is hot"),
    "the arm is not connected": (troubled("absent"), "does not start: .*no arm at /dev/ttyUSB0"),
    "the measurement is none": (troubled("measures nothing"), "the objective f must be finite, got nan"),
    "a command is beyond the limits": (
        troubled("nan"),
        "trial 0 was aborted: .*must be a finite number, got nan",
    ),
    "the driver's Python is missing": (no_python, "cannot start the process at .* with /opt/lab/bin/python"),
    "the driver's module is missing": (no_module, "does not start: .*No module named 'arm_of_nobody'"),
    "the limits reject the plan": (
        limits_that_reject,
        r"trial 0 was rejected: .*joint1 must lie in \[-0.001, 0.001\]",
    ),
    "the limits are none": (limits_that_are_none, "'positoin' is no limit; there are position"),
    "a real robot has no limits": (
        a_real_robot_without_limits,
        "has no limits, and does not move without: write ",
    ),
    "another campaign has the robot": (a_robot_that_somebody_has, "is held by the campaign in .*other"),
    "the folder is a copy": (a_copied_folder, "The folder is a copy, or was restored or rolled back"),
    "the home is another": (another_home, "knows nothing of it: name the home it was begun with"),
    "the robot is stopped": (a_stopped_robot, "the robot was stopped by Bob .*it smells"),
    "the latch cannot be read": (a_latch_that_cannot_be_read, "STOPPED is there, and cannot be read"),
    "the ledger is damaged": (a_damaged_ledger, "ledger.jsonl is damaged: line 2 was altered. Nothing moves"),
    "the journal is damaged": (a_damaged_journal, "journal.sqlite is damaged: .*nothing will be granted"),
    "the attachments are damaged": (
        damaged_attachments,
        "the list of attachments is damaged: .*line .* was altered",
    ),
    "the disk is full": (a_full_disk, "it needs a writable local disk with space left"),
    "the limits change": (
        limits_that_change_after_the_approval,
        "limits have changed since the approval of operator: Ada",
    ),
    "the robot must rest": (a_robot_that_must_rest, r"the robot rests 3\d\d\d s more, as its limits say"),
    "a number is wrong": (a_wrong_number, "must lie in .* got 1e.308.*misleads every later suggestion"),
    "nobody approves": (an_approval_by_nobody, "who must name a person, got nothing"),
    "a trial waits": (a_trial_that_waits, "trial 0 waits for a person since .*svaedc hardware approve "),
}


@pytest.mark.slow
@pytest.mark.parametrize("situation", PROVOKED)
def test_the_cause_is_told(situation, lab, monkeypatch):
    provoke, told = PROVOKED[situation]
    said = provoke(lab, monkeypatch)
    with pytest.raises(UserError, match=f"(?s){told}"):
        raise UserError(said)
    assert "Traceback" not in said
