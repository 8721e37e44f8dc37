"""Proposals: from what they are computed, and with which model."""

import json

import numpy as np
import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware.executor import Executor
from cluster.hardware.plan import identify
from cluster.hardware.proposals import Proposals, fingerprint, library_versions
from cluster.hardware.record import export
from cluster.hardware.states import Approval
from cluster.optimization.candidates import TABLE, write
from svaedc.bo.history import History
from svaedc.model import checkpoint
from tests.cluster.hardware.rehearsals import ROBOT, carried_out, plan_in
from tests.cluster.optimization.tables import table
from workers import setups


def test_the_check_records_the_badness_that_the_model_expects(tmp_path, model):
    carried_out(plan_in(tmp_path, "svae-dc", 0, model))
    events = [json.loads(line) for line in export.lines(tmp_path)][1:]
    checks = [json.loads(event["body"]) for event in events if event["new"] == "checked"]
    assert [0.0 <= check["predicted_y"] <= 1.0 for check in checks] == [True, True]


def test_proposals_keep_the_versions_they_were_computed_with(tmp_path):
    carried_out(plan_in(tmp_path, trials=0))
    bodies = [json.loads(json.loads(line).get("body", "{}")) for line in export.lines(tmp_path)]
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


def test_a_campaign_chooses_among_the_candidates_it_was_planned_with_and_no_others(tmp_path):
    path, candidates = tmp_path / TABLE, table()
    write(path, candidates)
    identity = identify(ROBOT, "simulated-best", 1, 0, 100, None, Approval.POLICY, path)
    setup = setups.load(identity.setup)
    proposals = Proposals.of(identity, setup, None, path)
    assert proposals.random(History.empty(setup.dimensions), 0).tobytes() in {
        row.tobytes() for row in candidates.drawn
    }
    best = candidates.x[candidates.f.mean(axis=1).argmax()]
    assert np.array_equal(proposals.suggest(History.empty(setup.dimensions), 2), best)
    with pytest.raises(UserError, match=r"candidates \(none\) are not those"):
        Proposals.of(identity, setup, None)
    write(path, table(chosen=6))
    with pytest.raises(UserError, match="are not those that this campaign was planned with"):
        Proposals.of(identity, setup, None, path)


def test_a_method_that_lacks_its_candidates_is_refused():
    with pytest.raises(UsageError, match="needs candidates that were simulated, got none"):
        identify(ROBOT, "simulated-best", 1, 0, 9, None, Approval.POLICY)
