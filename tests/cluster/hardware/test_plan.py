"""Plans of campaigns: what they mean, and what they refuse."""

import sys
from pathlib import Path

import pytest

from cluster.errors import UsageError, UserError
from cluster.hardware.executor import Executor
from cluster.hardware.identity import IdentityMismatch
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval
from cluster.hardware.status import Phase
from tests.cluster.hardware.rehearsals import ROBOT, carried_out, plan_in


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
    with pytest.raises(UserError, match=r"cannot read the model or candidates .*none\.pt"):
        plan_in(tmp_path, "svae-dc", model=tmp_path / "none.pt")


OWN = """
from dataclasses import replace
from workers import setups
from workers.hardware.robots import Robot
from svaedc.bo.strategies import UniformSearch

def setup():
    return setups.load("quadratic-30d")

ARM = Robot("arm", "own_lab:setup", "own_lab:Arm")

def mine(problem):
    return UniformSearch(problem.dimensions)

def lame(problem):
    return problem.nothing
"""


@pytest.fixture
def own_lab(tmp_path, monkeypatch):
    """The file of a user's module in the working directory, which is not on Python's path."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    path = tmp_path / "own_lab.py"
    path.write_text(OWN)
    yield path
    sys.modules.pop("own_lab", None)


def identity_with(robot, method="random", approval=Approval.POLICY):
    return identify(robot, method, 1, 3, 50, None, approval)


@pytest.mark.usefixtures("own_lab")
def test_a_real_robot_moves_only_after_a_person_has_approved():
    with pytest.raises(
        UsageError, match=r"'own_lab:ARM' must be a simulated stand-in for it.* --approval operator"
    ):
        identity_with("own_lab:ARM")
    identity = identity_with("own_lab:ARM", approval=Approval.OPERATOR)
    assert (identity.robot, identity.setup) == ("own_lab:ARM", "own_lab:setup")


def test_a_setup_and_a_method_of_ones_own_are_rehearsed_and_their_files_are_part_of_the_campaign(
    own_lab, tmp_path
):
    def plan():
        return CampaignPlan(
            identity_with("rehearsal:own_lab:setup", "own_lab:mine"), tmp_path / "campaign", None, 0.0
        )

    seen = carried_out(plan())
    assert (seen.phase, seen.measured) == (Phase.COMPLETE, 3)
    assert seen.name.startswith("rehearsal:own_lab:setup-")
    assert carried_out(plan()) == seen
    own_lab.write_text(OWN + "# changed\n")
    with pytest.raises(
        IdentityMismatch, match=r"own_lab\.py has changed since the campaign in .* was begun; put the"
    ):
        Executor(plan())


@pytest.mark.usefixtures("own_lab")
def test_a_method_that_cannot_be_made_ends_the_campaign_before_it_begins(tmp_path):
    plan = CampaignPlan(identity_with("rehearsal:own_lab", "own_lab:lame"), tmp_path / "campaign", None, 0.0)
    with pytest.raises(UsageError, match=r"own_lab:lame failed with AttributeError: .*own_lab\.py:16"):
        Executor(plan)


def test_what_ships_leaves_no_trace_of_its_code():
    assert identity_with(ROBOT).codes == ""
    assert "codes" not in identity_with(ROBOT).facts()
