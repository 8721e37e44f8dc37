"""First trials that campaigns of one robot share: imported, and nothing moves for them."""

import json
from dataclasses import replace

import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware import operator
from cluster.hardware.plan import identify
from cluster.hardware.record import export
from cluster.hardware.record.first_trials import first_trials
from cluster.hardware.states import Approval
from tests.cluster.hardware.rehearsals import ROBOT, carried_out, plan_in
from workers.hardware import robots
from workers.host.home import RobotHome


@pytest.fixture(scope="module")
def measured(tmp_path_factory):
    """The folder of a campaign with two random trials."""
    folder = tmp_path_factory.mktemp("first")
    carried_out(plan_in(folder, "random", 0))
    return folder


def sharing(folder, measured, method="se", trials=1):
    first = first_trials(measured, ROBOT, 2)
    identity = identify(ROBOT, method, trials, 3, 50, None, Approval.POLICY, None, 0.05, first)
    return replace(plan_in(folder, method, trials), identity=identity, first=first)


def test_shared_trials_are_measured_at_once_and_move_nothing(measured, tmp_path):
    plan = sharing(tmp_path / "second", measured)
    now, theirs = carried_out(plan), operator.status(measured)
    assert [trial.kind for trial in now.trials] == ["imported", "imported", "suggested"]
    assert [trial.x_hex for trial in now.trials[:2]] == [trial.x_hex for trial in theirs.trials]
    assert [trial.measurement for trial in now.trials[:2]] == [trial.measurement for trial in theirs.trials]
    events = [json.loads(line) for line in export.lines(tmp_path / "second")][1:]
    assert [event["new"] for event in events[:4]] == ["proposed", "measured", "proposed", "measured"]
    assert json.loads(events[1]["body"])["campaign"] == theirs.name


def test_the_robots_ledger_knows_nothing_of_them(measured, tmp_path):
    home = tmp_path / "home"
    plan = replace(sharing(tmp_path / "second", measured), home=home)
    carried_out(plan)
    started = [e.facts["trial"] for e in RobotHome(home, ROBOT).ledger.entries() if e.event == "started"]
    assert [trial[-3:] for trial in started] == ["002"]


def test_the_same_method_suggests_as_if_it_had_measured_them_itself(measured, tmp_path):
    alone = carried_out(plan_in(tmp_path / "alone", "se", 1))
    shared = carried_out(sharing(tmp_path / "shared", measured))
    assert [trial.x_hex for trial in shared.trials] == [trial.x_hex for trial in alone.trials]


def test_they_are_shared_on_and_belong_to_the_campaign(measured, tmp_path):
    second = tmp_path / "second"
    carried_out(sharing(second, measured))
    assert [each.x_hex for each in first_trials(second, ROBOT, 2)] == [
        each.x_hex for each in first_trials(measured, ROBOT, 2)
    ]
    alone = plan_in(second, "se", 1)
    with pytest.raises(UserError, match=r"holds a campaign with first '[0-9a-f]{64}', asked for ''"):
        carried_out(replace(alone, identity=replace(alone.identity, avoid=0.05)))


def test_another_robot_and_too_few_are_refused(measured, tmp_path):
    with pytest.raises(UsageError, match="share those of the same robot"):
        first_trials(measured, "yumi-rehearsal", 2)
    with pytest.raises(UsageError, match="has 2 first trials that were measured, and 3"):
        first_trials(measured, ROBOT, 3)
    with pytest.raises(UserError, match="no campaign in"):
        first_trials(tmp_path, ROBOT, 2)
    assert robots.find(ROBOT).simulated
