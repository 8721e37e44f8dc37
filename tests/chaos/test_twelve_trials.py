"""`kill -9` in each of twelve trials: the controllers are those of a campaign that nothing disturbed."""

import signal
from contextlib import closing

import pytest

from cluster.hardware import operator
from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan, identify
from cluster.hardware.states import Approval, State
from cluster.hardware.status import Phase
from tests.chaos.crash_points import watch
from tests.chaos.test_crash_points import place
from workers.hardware.records import motion_in
from workers.host.home import RobotHome

ROBOT = "rehearsal:quadratic-30d"


def plan_in(folder, home, method):
    identity = identify(ROBOT, method, 10, 3, 200, None, Approval.POLICY)
    return CampaignPlan(identity, folder, None, 0.0, None, home)


def carry_on(folder, home, method, points, kill_at):
    """The start command, without Ray."""
    if kill_at:
        watch(points, kill_at)
    with closing(Executor(plan_in(folder, home, method))) as executor:
        while executor.status().phase is Phase.READY:
            executor.advance()


def decide(folder, home):
    """A person who saw the robot says of the trial that was cut what its ledger says; how many there were."""
    now = operator.status(folder)
    cut = [trial for trial in now.trials if trial.state in (State.RUNNING, State.UNKNOWN)]
    for trial in cut:
        seen = motion_in(RobotHome(home, ROBOT).ledger, f"{now.name}-{trial.number:03d}").measurement
        operator.resolve(folder, trial.number, "measured", "Ada", "seen", seen.f, seen.y, seen.f)
    return len(cut)


@pytest.mark.chaos
@pytest.mark.parametrize("method", ["se", "botorch", "random"])
def test_a_kill_in_each_of_twelve_trials_changes_no_controller(processes, tmp_path, method):
    whole, pieces, points = tmp_path / "whole", tmp_path / "pieces", tmp_path / "points.log"
    carry_on(whole, tmp_path / "home-whole", method, points, "")
    moved = place("campaign.py", "campaign.robot.run(")
    cuts = 0
    for _ in range(12):
        arguments = (pieces, tmp_path / "home", method, points, f"{moved},0")
        process = processes.Process(target=carry_on, args=arguments)
        process.start()
        process.join()
        assert process.exitcode == -signal.SIGKILL
        cuts += decide(pieces, tmp_path / "home")
    expected, found = operator.status(whole), operator.status(pieces)
    assert found.phase is Phase.COMPLETE
    assert cuts == 12
    assert [(t.x_hex, t.f, t.y) for t in found.trials] == [(t.x_hex, t.f, t.y) for t in expected.trials]
