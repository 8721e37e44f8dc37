"""Plans, the executor and the station, on the real rehearsal robot and without Ray."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from cluster.errors import UsageError, UserError
from cluster.hardware import operator, station
from cluster.hardware.executor import Executor
from cluster.hardware.identity import Approval, IdentityMismatch
from cluster.hardware.lock import FolderTaken
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.proposals import Proposals, fingerprint, library_versions
from cluster.hardware.station import RobotBusy, Station
from cluster.hardware.status import Phase
from svaedc.bo import methods
from svaedc.model import checkpoint
from svaedc.model.config import ModelConfig
from svaedc.model.svae_dc import SvaeDc
from workers import setups
from workers.hardware.ledger import MotionLedger

ROBOT = "franka-rehearsal"


def plan_in(folder, method="random", trials=1, model=None, approval=Approval.POLICY):
    return CampaignPlan(identify(ROBOT, method, trials, 3, 50, model, approval), folder, model, 0.0)


def carried_out(plan):
    executor = Executor(plan)
    try:
        seen = executor.status()
        while seen.phase is Phase.READY:
            seen = executor.advance()
    finally:
        executor.close()
    return seen


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """An untrained model of the setup's sizes: what it says is arbitrary, but it says it every time."""
    setup = setups.load("franka")
    torch.manual_seed(0)
    config = ModelConfig(
        controller_dim=setup.dimensions, observation_dim=len(setup.observation), time_steps=100
    )
    path = tmp_path_factory.mktemp("model") / "model.pt"
    checkpoint.save(path, SvaeDc(config), {"setup": "franka"})
    return path


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"robot": "franka-rehersal"}, "did you mean 'franka-rehearsal'"),
        ({"method": "svae-cd"}, "did you mean 'svae-dc'"),
        ({"seed": -1}, "seed must be at least 0"),
        ({"trials": -1}, "trials must be at least 0"),
        ({"pool": 0}, "pool must be at least 1"),
        ({"method": "svae-dc"}, "needs a trained model, got none; give one with --model"),
    ],
)
def test_a_plan_with_an_impossible_argument_is_refused(change, message):
    good = {
        "robot": ROBOT, "method": "se", "trials": 1, "seed": 0, "pool": 9, "model": None,
        "approval": Approval.POLICY,
    }  # fmt: skip
    with pytest.raises(UsageError, match=message):
        identify(**(good | change))


@pytest.mark.parametrize("pace", [-1.0, 1e10, float("inf"), float("nan")])
def test_a_pace_that_nothing_can_wait_for_is_refused(tmp_path, pace):
    with pytest.raises(UsageError, match=r"pace must lie in \[0, 86400\] s, got"):
        CampaignPlan(plan_in(tmp_path).identity, tmp_path, None, pace)


def test_a_plan_means_the_same_folder_in_every_working_directory(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert plan_in(Path("here")).folder == tmp_path / "here"


@pytest.mark.parametrize("method", ["random", "se", "svae-dc"])
def test_a_rehearsal_campaign_runs_to_its_end(tmp_path, model, method):
    seen = carried_out(plan_in(tmp_path / method, method, 2, model if methods.needs_model(method) else None))
    assert seen.phase is Phase.COMPLETE
    assert [trial.kind for trial in seen.trials] == ["random", "random", "suggested", "suggested"]
    starts = MotionLedger(tmp_path / method / "starts.jsonl").entries()
    assert [entry["event"] for entry in starts] == ["started", "ended"] * 4


@pytest.mark.parametrize("method", ["se", "svae-dc"])
def test_an_interrupted_campaign_proposes_bit_for_bit_what_an_undisturbed_one_does(tmp_path, model, method):
    used = model if methods.needs_model(method) else None
    whole = carried_out(plan_in(tmp_path / "whole", method, 2, used))
    seen = None
    while seen is None or seen.phase is Phase.READY:
        executor = Executor(plan_in(tmp_path / "pieces", method, 2, used))
        seen = executor.advance()
        executor.close()
    assert [(t.x_hex, t.f, t.y) for t in seen.trials] == [(t.x_hex, t.f, t.y) for t in whole.trials]


def test_the_check_records_the_badness_that_the_model_expects(tmp_path, model):
    carried_out(plan_in(tmp_path, "svae-dc", 0, model))
    events = [json.loads(line) for line in operator.export(tmp_path)][1:]
    checks = [json.loads(event["body"]) for event in events if event["new"] == "checked"]
    assert [0.0 <= check["predicted_y"] <= 1.0 for check in checks] == [True, True]


def test_proposals_keep_the_versions_they_were_computed_with(tmp_path):
    carried_out(plan_in(tmp_path, trials=0))
    bodies = [json.loads(json.loads(line).get("body", "{}")) for line in operator.export(tmp_path)]
    assert [body["versions"] for body in bodies if "versions" in body] == 2 * [library_versions()]
    assert library_versions()["numpy"] == np.__version__


def test_another_campaign_in_the_folder_is_refused_naming_the_field(tmp_path):
    carried_out(plan_in(tmp_path, trials=0))
    with pytest.raises(IdentityMismatch, match="holds a campaign with trials '0', asked for '1'"):
        Executor(plan_in(tmp_path, trials=1))
    assert carried_out(plan_in(tmp_path, trials=0)).phase is Phase.COMPLETE


def test_a_second_executor_is_refused_while_the_first_holds_the_folder(tmp_path, monkeypatch):
    monkeypatch.setattr("cluster.hardware.executor.PATIENCE_SECONDS", 0.1)
    first = Executor(plan_in(tmp_path))
    with pytest.raises(FolderTaken, match="is being executed by process"):
        Executor(plan_in(tmp_path))
    first.close()
    second = Executor(plan_in(tmp_path))
    assert second.status().phase is Phase.READY
    second.close()


def test_a_folder_that_cannot_be_made_is_named(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(UserError, match="cannot make the folder"):
        Executor(plan_in(tmp_path / "file" / "campaign"))


def test_a_model_that_is_missing_is_named(tmp_path):
    with pytest.raises(UserError, match=r"cannot read the model .*none\.pt"):
        plan_in(tmp_path, "svae-dc", model=tmp_path / "none.pt")


def test_a_model_that_changed_after_planning_is_refused(tmp_path, model):
    copy = tmp_path / "model.pt"
    copy.write_bytes(model.read_bytes())
    plan = plan_in(tmp_path / "campaign", "svae-dc", 0, copy)
    copy.write_bytes(b"another")
    with pytest.raises(UserError, match="is not the one this campaign was planned with"):
        Executor(plan)


@pytest.mark.parametrize("content", ["another setup", "no checkpoint"])
def test_a_model_that_does_not_serve_the_robot_is_refused(tmp_path, model, content):
    path = tmp_path / "model.pt"
    if content == "another setup":
        checkpoint.save(path, checkpoint.load(model)[0], {"setup": "yumi"})
    else:
        path.write_bytes(b"no checkpoint")
    with pytest.raises(UserError, match=r"model\.pt"):
        Executor(plan_in(tmp_path / "campaign", "svae-dc", 0, path))


def test_a_method_without_model_predicts_nothing():
    setup = setups.load("franka")
    proposals = Proposals.of(identify(ROBOT, "se", 1, 0, 9, None, Approval.POLICY), setup, None)
    assert proposals.predict(np.full(setup.dimensions, 0.5)) is None
    assert fingerprint(None) == ""


def test_a_station_goes_on_with_the_campaign_it_has(tmp_path):
    post = Station()
    plan = plan_in(tmp_path)
    post.enter(plan)
    post.advance(plan)
    assert post.enter(replace(plan, pace=0.1)).measured == 1
    post.leave()


def test_a_station_refuses_another_campaign_while_the_drivers_of_the_first_ask(tmp_path):
    post = Station()
    post.enter(plan_in(tmp_path / "first"))
    with pytest.raises(RobotBusy, match=r"is held by the campaign in .*first"):
        post.enter(plan_in(tmp_path / "second"))
    with pytest.raises(RobotBusy, match=r"no longer serves the campaign in .*second"):
        post.advance(plan_in(tmp_path / "second"))
    post.leave()


def test_a_station_whose_driver_is_gone_is_handed_on_between_trials(tmp_path, monkeypatch):
    monkeypatch.setattr(station, "IDLE_SECONDS", 0.0)
    post = Station()
    first, second = plan_in(tmp_path / "first"), plan_in(tmp_path / "second")
    post.enter(first)
    post.enter(second)
    assert post.advance(second).measured == 1
    with pytest.raises(RobotBusy, match="no longer serves"):
        post.advance(first)
    post.leave()
    assert operator.status(tmp_path / "first").measured == 0


def test_a_driver_that_withdraws_empties_only_its_own_place(tmp_path):
    post = Station()
    plan, other = plan_in(tmp_path / "first"), plan_in(tmp_path / "second")
    assert post.withdraw(other)
    post.enter(plan)
    assert not post.withdraw(other)
    assert post.advance(plan).measured == 1
    assert post.withdraw(plan)
    post.enter(other)
    post.leave()
