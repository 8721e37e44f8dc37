"""What a person sees and decides."""

import json
import os
import signal
from contextlib import closing
from dataclasses import asdict, replace
from datetime import UTC, datetime, timedelta

import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware import campaign, journal, operator
from cluster.hardware.journal import IllegalTransition
from cluster.hardware.lock import FolderLock, FolderTaken
from cluster.hardware.record import export
from cluster.hardware.states import Approval, State
from cluster.hardware.status import Phase
from tests.cluster.hardware.desk import IDENTITY, DeskRobot, Fuse, campaign_on, carry_out, opened, starts
from workers import setups

IN_MOTION = 13

AFTER_MOTION = 14
"""Points of the first trial's way, see test_kills."""


def die(processes, folder, point):
    process = processes.Process(target=carry_out, args=(folder, point))
    process.start()
    process.join()
    assert process.exitcode == -signal.SIGKILL


def test_a_trial_left_running_is_explained_and_resolved_as_measured(processes, tmp_path):
    die(processes, tmp_path, IN_MOTION)
    assert operator.status(tmp_path).phase is Phase.RUNNING
    assert "left behind by a dead process" in operator.status(tmp_path).advice
    carry_out(tmp_path)
    seen = operator.status(tmp_path)
    assert seen.phase is Phase.AWAITS_RESOLUTION
    assert "its ledger: started, never ended" in seen.advice
    assert f"svaedc hardware resolve {tmp_path} --trial 0" in seen.advice
    trial = operator.resolve(tmp_path, 0, "measured", "Ada", "read it off the tape", 0.5, 0.1)
    assert (trial.state, trial.measurement) == (State.MEASURED, (0.5, 0.1))
    assert carry_out(tmp_path)[0] is Phase.COMPLETE
    assert starts(tmp_path) == [f"desk-1-{number:03d}" for number in range(4)]


def test_what_the_ledger_still_knows_is_told(processes, tmp_path):
    die(processes, tmp_path, AFTER_MOTION)
    carry_out(tmp_path)
    measurement = DeskRobot(tmp_path, Fuse(-1)).motion("desk-1-000").measurement
    assert f"its ledger: ended with f {measurement.f}, y {measurement.y}" in operator.status(tmp_path).advice


@pytest.mark.parametrize("outcome", ["failed", "aborted"])
def test_a_running_trial_can_be_resolved_at_once_and_is_replaced_by_another(processes, tmp_path, outcome):
    die(processes, tmp_path, IN_MOTION)
    operator.resolve(tmp_path, 0, outcome, "Ada", "it fell", None, None)
    assert carry_out(tmp_path)[0] is Phase.COMPLETE
    with closing(opened(tmp_path)) as book:
        assert [trial.state for trial in book.trials()] == [outcome, *4 * ["measured"]]
        past = [event for event in book.events() if event.trial == 0]
    assert [event.new for event in past][-3:] == ["running", "unknown", outcome]
    assert json.loads(past[-2].body)["ledger"] == {"started": True, "measurement": None, "certain": True}
    assert past[-1].who == "operator: Ada"
    assert json.loads(past[-1].body) == {"note": "it fell"}


def test_a_trial_that_runs_at_this_moment_is_not_resolved(tmp_path):
    journal.create(tmp_path / journal.FILE, "desk-1", IDENTITY)
    with closing(opened(tmp_path)) as book, FolderLock(tmp_path, 0.0):
        trial = campaign.propose(campaign_on(book, DeskRobot(tmp_path, Fuse(-1))))
        for state in (State.CHECKED, State.APPROVED, State.GRANTED, State.RUNNING):
            trial = campaign.record(book, trial, state, "test", {})
        with pytest.raises(FolderTaken, match=f"process {os.getpid()}"):
            operator.resolve(tmp_path, 0, "aborted", "Ada", "no", None, None)
        assert book.trial(0).state is State.RUNNING


def test_an_amendment_replaces_the_measurement_and_keeps_the_old(tmp_path):
    carry_out(tmp_path)
    assert operator.resolve(tmp_path, 2, "measured", "Ada", "tape was wrong", -0.5, 0.0).measurement == (
        -0.5,
        0.0,
    )
    assert len([line for line in export.lines(tmp_path) if '"new":"measured"' in line]) == 5


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"outcome": "done"}, "outcome must be one of measured, failed, aborted, got 'done'"),
        ({"note": " "}, "a resolution needs a note"),
        ({"who": ""}, "who must name a person"),
        ({"f": None}, "a measured trial needs a finite objective, got None"),
        ({"f": float("nan")}, "a measured trial needs a finite objective, got nan"),
        ({"y": None}, r"a measured trial needs a badness in \[0, 1\], got None"),
        ({"y": 1.1}, r"a measured trial needs a badness in \[0, 1\], got 1.1"),
        ({"outcome": "failed"}, "f and y belong to the outcome measured"),
    ],
)
def test_a_resolution_that_lacks_something_is_refused(tmp_path, change, message):
    carry_out(tmp_path)
    good = {"outcome": "measured", "who": "Ada", "note": "seen", "f": 0.5, "y": 0.1}
    with pytest.raises(UsageError, match=message):
        operator.resolve(tmp_path, 0, **(good | change))


def test_an_ended_trial_is_not_resolved_into_something_else(tmp_path):
    carry_out(tmp_path)
    with pytest.raises(IllegalTransition, match="from measured to aborted; legal from there: measured"):
        operator.resolve(tmp_path, 0, "aborted", "Ada", "seen", None, None)


def test_a_waiting_trial_is_named_with_the_command_that_approves_it(tmp_path):
    identity = replace(IDENTITY, approval=Approval.OPERATOR)
    carry_out(tmp_path, identity=identity)
    seen = operator.status(tmp_path)
    assert seen.phase is Phase.AWAITS_APPROVAL
    assert f"svaedc hardware approve {tmp_path} --trial 0 --who NAME" in seen.advice
    assert operator.approve(tmp_path, 0, "Ada").state is State.APPROVED
    assert seen.motion["plan"] == {"objection": "", "seconds": 50.0}
    assert operator.status(tmp_path).motion == {}
    with pytest.raises(IllegalTransition, match="from approved to approved"):
        operator.approve(tmp_path, 0, "Grace")


def test_nobody_is_not_a_person(tmp_path):
    carry_out(tmp_path, identity=replace(IDENTITY, approval=Approval.OPERATOR))
    with pytest.raises(UsageError, match="who must name a person"):
        operator.approve(tmp_path, 0, "  ")


def test_status_counts_and_finds_the_best(tmp_path):
    carry_out(tmp_path)
    seen = operator.status(tmp_path)
    assert (seen.measured, seen.planned, seen.phase, seen.advice) == (4, 4, Phase.COMPLETE, "")
    assert seen.best == max(trial.f for trial in seen.trials)


def test_a_failed_trial_is_told_with_its_reason(tmp_path):
    journal.create(tmp_path / journal.FILE, "desk-1", IDENTITY)
    with closing(opened(tmp_path)) as book:
        campaign.advance(campaign_on(book, DeskRobot(tmp_path, Fuse(-1), faulty=frozenset({0}))))
    assert operator.status(tmp_path).advice.startswith("trial 0 was failed: a motor is hot; see to it")


def test_a_failed_trial_is_told_with_its_reason_after_another_was_amended(tmp_path):
    journal.create(tmp_path / journal.FILE, "desk-1", IDENTITY)
    with closing(opened(tmp_path)) as book:
        for _ in range(2):
            campaign.advance(campaign_on(book, DeskRobot(tmp_path, Fuse(-1), faulty=frozenset({1}))))
    operator.resolve(tmp_path, 0, "measured", "Ada", "tape was wrong", -0.5, 0.0)
    assert operator.status(tmp_path).advice.startswith("trial 1 was failed: a motor is hot; see to it")
    assert carry_out(tmp_path)[0] is Phase.COMPLETE


def test_the_export_is_the_campaign_and_every_event(tmp_path):
    carry_out(tmp_path)
    first, *events = [json.loads(line) for line in export.lines(tmp_path)]
    assert first == {"campaign": "desk-1", **IDENTITY.facts()}
    with closing(opened(tmp_path)) as book:
        assert events == [asdict(event) for event in book.events()]


WAITING = replace(IDENTITY, approval=Approval.OPERATOR)


def test_an_approval_is_bound_holds_for_a_while_and_can_be_withdrawn(tmp_path):
    carry_out(tmp_path, identity=WAITING)
    operator.approve(tmp_path, 0, "Ada", minutes=5.0)
    with closing(opened(tmp_path)) as book:
        bounds = json.loads(book.events()[-1].body)
    left = datetime.fromisoformat(bounds["until"]) - datetime.now(UTC)
    assert timedelta(minutes=4) < left <= timedelta(minutes=5.0)
    assert len(bounds["limits"]) == len(bounds["sha256"]) == 64
    assert operator.withdraw(tmp_path, 0, "Grace").state is State.CHECKED
    assert operator.status(tmp_path).phase is Phase.AWAITS_APPROVAL
    with pytest.raises(IllegalTransition, match="from checked to checked"):
        operator.withdraw(tmp_path, 0, "Grace")
    for minutes in (0.0, -1.0, float("inf"), float("nan")):
        with pytest.raises(UsageError, match="an approval must hold for some minutes, got"):
            operator.approve(tmp_path, 0, "Ada", minutes)


def test_a_rejected_controller_never_comes_back_and_another_waits(tmp_path):
    carry_out(tmp_path, identity=WAITING)
    with pytest.raises(UsageError, match="a rejection needs a note that says why"):
        operator.reject(tmp_path, 0, "Ada", " ")
    assert operator.reject(tmp_path, 0, "Ada", "it looks wild").state is State.REJECTED
    carry_out(tmp_path, identity=WAITING)
    seen = operator.status(tmp_path)
    assert (seen.phase, len(seen.trials)) == (Phase.AWAITS_APPROVAL, 2)
    assert seen.trials[0].x_hex != seen.trials[1].x_hex
    assert starts(tmp_path) == []


def test_only_a_measured_trial_is_amended_and_the_old_value_stays(tmp_path):
    carry_out(tmp_path, faulty=frozenset({1}))
    assert operator.amend(tmp_path, 0, "Ada", "tape", -0.25, 0.5).measurement == (-0.25, 0.5)
    with pytest.raises(UsageError, match="only a measured trial can be amended, trial 1 is failed"):
        operator.amend(tmp_path, 1, "Ada", "tape", -0.25, 0.5)


def test_an_objective_that_the_setup_rules_out_is_typed_twice(tmp_path):
    known = replace(IDENTITY, setup="quadratic-30d")
    carry_out(tmp_path, identity=known)
    low, high = setups.load("quadratic-30d").objective_limits
    for f in (low - 1, high + 1, 1e308):
        with pytest.raises(
            UsageError, match=r"must lie in .*, got .* if it is meant, type it again with --confirm"
        ):
            operator.amend(tmp_path, 0, "Ada", "tape", f, 0.5)
        with pytest.raises(UsageError, match="type it again"):
            operator.amend(tmp_path, 0, "Ada", "tape", f, 0.5, confirmed=f / 2)
    assert operator.amend(tmp_path, 0, "Ada", "tape", high + 1, 0.5, confirmed=high + 1).f == high + 1
    assert operator.amend(tmp_path, 0, "Ada", "tape", high, 0.5).f == high


def test_who_only_looks_writes_nothing(tmp_path, monkeypatch):
    carry_out(tmp_path)
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write anywhere but on read-only media
    before = {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()}
    seen, exported = operator.status(tmp_path), list(export.lines(tmp_path))
    assert (seen.phase, seen.folder, len(exported)) == (Phase.COMPLETE, tmp_path, 1 + 4 * 6)
    assert {path.name: path.stat().st_mtime_ns for path in tmp_path.iterdir()} == before
    with pytest.raises(UserError, match=f"no campaign in {tmp_path / 'none'}"):
        operator.status(tmp_path / "none")
