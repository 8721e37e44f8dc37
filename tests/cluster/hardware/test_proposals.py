"""Proposals: from what they are computed, and with which model."""

import json

import numpy as np
import pytest

from cluster.errors import UserError
from cluster.hardware import operator
from cluster.hardware.executor import Executor
from cluster.hardware.plan import identify
from cluster.hardware.proposals import Proposals, fingerprint, library_versions
from cluster.hardware.states import Approval
from svaedc.model import checkpoint
from tests.cluster.hardware.rehearsals import ROBOT, carried_out, plan_in
from workers import setups


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
