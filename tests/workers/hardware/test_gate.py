"""A robot serves the folder it knows; a copy, a backup or a stranger is refused, with the way out."""

import shutil
from datetime import UTC, datetime, timedelta

import numpy as np
import pytest

from workers.hardware.gate import Gate, GateShut
from workers.hardware.ledger import FILE, MotionLedger
from workers.host.home import RobotHome
from workers.host.ledger import LedgerDamaged
from workers.host.limits import RobotLimits
from workers.host.serve import STARTED


@pytest.fixture
def home(tmp_path):
    return RobotHome(tmp_path / "home", "desk").make()


@pytest.fixture
def gate(home, tmp_path):
    (tmp_path / "one").mkdir()
    return Gate(home, RobotLimits(), tmp_path / "one")


def test_a_folder_whose_journal_has_every_grant_goes_on(gate):
    gate.require("desk-1", set(), granted=False)
    gate.grant("desk-1", "desk-1-000", "a" * 64)
    gate.grant("desk-2", "desk-2-000", "c" * 64)
    before = gate.home.ledger.entries()
    gate.require("desk-1", {"a" * 64, "b" * 64}, granted=True)
    assert [entry.event for entry in gate.home.ledger.entries()] == ["granted", "granted"]
    assert gate.home.ledger.entries() == before


def test_a_copy_a_backup_and_a_roll_back_are_refused_naming_the_trial_they_miss(gate):
    gate.grant("desk-1", "desk-1-000", "a" * 64)
    gate.grant("desk-1", "desk-1-001", "b" * 64)
    with pytest.raises(
        GateShut,
        match=r"has trial desk-1-001 granted at .*, and this journal has never heard of that\. The folder",
    ):
        gate.require("desk-1", {"a" * 64}, granted=True)
    with pytest.raises(GateShut, match=r"Go on in the folder that has that trial\. If it is lost, beg"):
        gate.require("desk-1", set(), granted=False)


def test_a_campaign_that_moved_the_robot_from_another_home_needs_a_person(gate):
    with pytest.raises(GateShut, match=r"knows nothing of it: .*svaedc hardware adopt .*/one --who NAME"):
        gate.require("desk-1", {"a" * 64}, granted=True)
    gate.adopt("desk-1", "operator: Ada")
    gate.require("desk-1", {"a" * 64}, granted=True)


def test_a_campaign_of_before_brings_its_own_ledger_once(gate, tmp_path):
    old = MotionLedger(gate.folder / FILE)
    old.start("desk-1-000", np.zeros(5))
    gate.require("desk-1", {"a" * 64}, granted=True)
    assert gate.motion("desk-1-000").started
    assert not gate.motion("desk-1-001").started
    shutil.copytree(gate.folder, tmp_path / "copy")
    gate.grant("desk-1", "desk-1-001", "b" * 64)
    with pytest.raises(GateShut, match="never heard of that"):
        Gate(gate.home, RobotLimits(), tmp_path / "copy").require("desk-1", {"a" * 64}, granted=True)


def test_rest_is_counted_from_the_starts_in_the_ledger(gate, home):
    assert gate.rest_seconds(datetime.now(UTC)) == 0
    home.ledger.append(STARTED, {"trial": "desk-1-000"})
    resting = Gate(home, RobotLimits.read({"rest": 100}, "limits"), gate.folder)
    assert 99 < resting.rest_seconds(datetime.now(UTC)) <= 100
    assert resting.rest_seconds(datetime.now(UTC) + timedelta(seconds=101)) == 0


def test_a_line_that_was_cut_off_makes_the_trial_granted_before_it_uncertain(gate, home):
    gate.grant("desk-1", "desk-1-000", "a" * 64)
    assert gate.motion("desk-1-000").certain
    with home.ledger.path.open("ab") as file:
        file.write(b'{"at":"2026')
    assert not gate.motion("desk-1-000").certain
    gate.grant("desk-1", "desk-1-001", "b" * 64)
    assert not gate.motion("desk-1-000").certain
    assert gate.motion("desk-1-001").certain


def test_a_damaged_ledger_lets_nothing_through(gate, home):
    gate.grant("desk-1", "desk-1-000", "a" * 64)
    gate.grant("desk-1", "desk-1-001", "b" * 64)
    home.ledger.path.write_bytes(home.ledger.path.read_bytes().replace(b"desk-1-000", b"desk-1-009"))
    for ask in (
        lambda: gate.require("desk-1", {"a" * 64}, granted=True),
        lambda: gate.grant("desk-1", "desk-1-002", "c" * 64),
        lambda: gate.motion("desk-1-000"),
        lambda: gate.rest_seconds(datetime.now(UTC)),
        gate.approval,
    ):
        with pytest.raises(LedgerDamaged, match=r"line 1 was altered\. Nothing moves"):
            ask()
