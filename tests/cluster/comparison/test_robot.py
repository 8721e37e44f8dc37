"""Trials whose code raises, hangs or ends its process cost themselves, on a real cluster too."""

import math

import numpy as np
import pytest

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.robot import HiddenRobot, safe_attempts
from tests.own_robot import write_robot
from workers import setups
from workers.attempts import Attempts
from workers.isolation import IsolatedAttempts

KEY = RunKey("random", 1000)
PHYSICS = {"mass": 1.0, "wind": 0.0}


def x(value: float) -> np.ndarray:
    return np.full(4, value, dtype=np.float32)


@pytest.fixture
def moody(tmp_path, monkeypatch):
    """It raises when it is pushed hard to the right."""
    monkeypatch.syspath_prepend(tmp_path)
    write_robot(tmp_path, "moody", ("force = command[0]", "force = {True: command[0]}[command[0] < 0.9]"))
    return setups.load("moody")


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "out" / "runs").mkdir(parents=True)
    return ComparisonFolder(tmp_path / "out")


def test_a_trial_that_raises_has_no_objective_and_an_account_of_its_own(moody, folder):
    with Attempts(moody) as attempts:
        robot = HiddenRobot(folder, KEY, moody, PHYSICS, attempts, next=0)
        sound = robot.evaluate(x(0.5))
        failed = robot.evaluate(x(1.0))
        again = robot.evaluate(x(0.5))
    assert math.isnan(failed.f)
    assert failed.stop.startswith("failed: KeyError: False, at ")
    assert (sound.f, sound.stop) == (again.f, again.stop) == (sound.f, "")
    (account,) = folder.failures()
    assert account.name == "random-01000-001.txt"
    text = account.read_text(encoding="utf-8")
    assert text.startswith("trial 1 of run random 1000 of moody failed: KeyError: False, at ")
    assert "svaedc render --setup moody --x 1,1,1,1 --physics mass=1.0,wind=0.0" in text


def test_only_a_run_that_ended_in_the_middle_of_a_trial_goes_on_in_isolation(moody, folder):
    with Attempts(moody) as attempts:
        for trials, noted, kind in ((3, None, Attempts), (3, 2, Attempts), (3, 3, IsolatedAttempts)):
            if noted is not None:
                folder.begin(KEY, noted)
            with safe_attempts(folder, KEY, trials, attempts, 5.0) as safe:
                assert type(safe) is kind
    folder.end(KEY)
    assert folder.under_way(KEY) is None


def test_a_note_that_a_full_disk_cut_off_counts_for_none(folder):
    folder.begin(KEY, 3)
    (note,) = (folder.path / "runs").glob("*.under-way")
    note.write_text("")
    assert folder.under_way(KEY) is None
