"""Plans of campaigns: what they mean, and what they refuse."""

from pathlib import Path

import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval
from tests.cluster.hardware.rehearsals import ROBOT, plan_in


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


def test_a_model_that_is_missing_is_named(tmp_path):
    with pytest.raises(UserError, match=r"cannot read the model .*none\.pt"):
        plan_in(tmp_path, "svae-dc", model=tmp_path / "none.pt")
