"""Campaigns on the real rehearsal robot, without Ray."""

from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval
from cluster.hardware.status import Phase

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
