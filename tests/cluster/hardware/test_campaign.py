"""The order of a campaign's steps: the journal first, the robot second, and the same proposals every time."""

import json
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from cluster.hardware import campaign, journal
from cluster.hardware.states import Approval, State
from cluster.hardware.status import Phase, measured_trials, phase_of, planned_trials, status
from tests.cluster.hardware.desk import (
    DIMENSIONS,
    IDENTITY,
    DeskGate,
    DeskRobot,
    Fuse,
    campaign_on,
    carry_out,
    climb,
    objective,
    opened,
    starts,
)
from workers.hardware.driver import RobotBroke, RobotFault, RobotStopped
from workers.randomness import Stream, generator


@pytest.fixture
def book(tmp_path):
    journal.create(tmp_path / journal.FILE, "desk-1", IDENTITY)
    with closing(opened(tmp_path)) as fresh:
        yield fresh


def robot_in(folder, **options):
    return DeskRobot(folder, Fuse(-1), **options)


def whole(folder):
    with closing(opened(folder)) as book:
        return book.trials(), book.events()


def test_a_campaign_measures_two_random_trials_and_then_the_planned_ones(tmp_path):
    assert carry_out(tmp_path)[0] is Phase.COMPLETE
    trials, _ = whole(tmp_path)
    assert [trial.kind for trial in trials] == ["random", "random", "suggested", "suggested"]
    assert [trial.f for trial in trials] == [objective(trial.x) for trial in trials]


def test_every_trial_passes_every_state_in_order(tmp_path):
    carry_out(tmp_path)
    order = ["proposed", "checked", "approved", "granted", "running", "measured"]
    assert [event.new for event in whole(tmp_path)[1]] == order * 4


def test_random_trials_come_from_their_own_stream_and_number(tmp_path):
    carry_out(tmp_path)
    expected = [
        generator(IDENTITY.seed, Stream.INITIAL, n).random(DIMENSIONS).astype(np.float32) for n in (0, 1)
    ]
    assert [t.x.astype(np.float32).tobytes() for t in whole(tmp_path)[0][:2]] == [
        x.tobytes() for x in expected
    ]


def test_a_suggestion_is_the_methods_answer_to_the_journal(tmp_path):
    carry_out(tmp_path)
    trials, _ = whole(tmp_path)
    past = campaign.history(trials[:3], DIMENSIONS)
    assert (
        trials[3].x.tobytes() == climb(past, generator(7, Stream.SUGGESTION, 3)).astype(np.float64).tobytes()
    )


def test_the_evidence_of_a_measurement_is_kept(tmp_path):
    carry_out(tmp_path)
    bodies = [json.loads(event.body) for event in whole(tmp_path)[1] if event.new is State.MEASURED]
    assert all(len(body["evidence"]) == 64 and body["stop"] == "" for body in bodies)


def test_the_approval_of_a_rehearsal_names_its_policy_and_the_controller(tmp_path):
    carry_out(tmp_path)
    trials, events = whole(tmp_path)
    approvals = [event for event in events if event.new is State.APPROVED]
    assert {event.who for event in approvals} == {"policy: rehearsal"}
    assert [json.loads(event.body)["sha256"] for event in approvals] == [trial.sha256 for trial in trials]


def test_the_robot_starts_only_after_running_is_in_the_journal(tmp_path, book):
    seen = []

    class Witness(DeskRobot):
        def run(self, trial_id, x):
            with closing(opened(tmp_path)) as other_connection:
                seen.append(other_connection.trials()[-1].state)
            return super().run(trial_id, x)

    campaign.advance(campaign_on(book, Witness(tmp_path, Fuse(-1))))
    assert seen == [State.RUNNING]


def test_one_advance_moves_the_robot_once(tmp_path, book):
    assert campaign.advance(campaign_on(book, robot_in(tmp_path))) is Phase.READY
    assert starts(tmp_path) == ["desk-1-000"]


def test_a_complete_campaign_does_nothing_more(tmp_path):
    carry_out(tmp_path)
    before = whole(tmp_path)
    assert carry_out(tmp_path)[0] is Phase.COMPLETE
    assert whole(tmp_path) == before


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (np.full(DIMENSIONS, 1.5), "must lie in"),
        (np.full(DIMENSIONS, -1e-3), "must lie in"),
        (np.full(DIMENSIONS, np.nan), "finite"),
        (np.full(DIMENSIONS, np.inf), "finite"),
        (np.full(DIMENSIONS + 1, 0.5), f"{DIMENSIONS} parameters, got {DIMENSIONS + 1}"),
        (np.empty(0), "got 0"),
    ],
)
def test_a_controller_outside_the_limits_is_rejected_and_moves_nothing(tmp_path, book, bad, reason):
    for _ in range(2):
        campaign.advance(campaign_on(book, robot_in(tmp_path)))
    campaign.advance(campaign_on(book, robot_in(tmp_path), suggest=lambda *_: bad))
    last = book.events()[-1]
    assert last.new is State.REJECTED
    assert reason in json.loads(last.body)["reason"]
    assert len(starts(tmp_path)) == 2


@pytest.mark.parametrize("edge", [0.0, 1.0])
def test_the_faces_of_the_unit_cube_are_within_the_limits(edge):
    assert campaign.objection(np.full(DIMENSIONS, edge), DIMENSIONS) is None


def test_an_operators_campaign_waits_for_approval_and_goes_on_after_it(tmp_path):
    identity = replace(IDENTITY, approval=Approval.OPERATOR, trials=0)
    for number in range(2):
        assert carry_out(tmp_path, identity=identity)[0] is Phase.AWAITS_APPROVAL
        assert len(starts(tmp_path)) == number
        with closing(opened(tmp_path)) as book:
            campaign.approve(book, book.trial(number), "operator: Ada", {})
    assert carry_out(tmp_path, identity=identity)[0] is Phase.COMPLETE


def test_a_fault_is_failed_and_the_campaign_measures_another_controller(tmp_path):
    carry_out(tmp_path, faulty=frozenset({1}))
    trials, events = whole(tmp_path)
    assert [trial.state for trial in trials] == ["measured", "failed", "measured", "measured", "measured"]
    assert len(starts(tmp_path)) == 5
    assert json.loads(next(e.body for e in events if e.new is State.FAILED)) == {"fault": "a motor is hot"}


def test_a_method_learns_nothing_from_a_failed_trial_but_that_it_was_tried(tmp_path):
    carry_out(tmp_path, faulty=frozenset({1}))
    trials, _ = whole(tmp_path)
    past = campaign.history(trials, DIMENSIONS)
    assert len(past) == 4
    assert past.failed.tobytes() == trials[1].x.tobytes()


def test_what_no_driver_declared_a_fault_leaves_the_trial_unknown(tmp_path, book):
    class Broken(DeskRobot):
        def run(self, trial_id, x):
            super().run(trial_id, x)
            raise OSError("cable")

    assert campaign.advance(campaign_on(book, Broken(tmp_path, Fuse(-1)))) is Phase.AWAITS_RESOLUTION
    assert campaign.advance(campaign_on(book, robot_in(tmp_path))) is Phase.AWAITS_RESOLUTION
    assert starts(tmp_path) == ["desk-1-000"]
    advice = status(book, None).advice
    assert "trial 0 may have moved the robot: the driver failed: OSError: cable, at " in advice
    assert "its ledger: ended with f" in advice


@pytest.mark.parametrize(
    ("error", "state", "advice"),
    [
        (
            RobotStopped("trial desk-1-000: stopped by Ada"),
            "aborted",
            "trial 0 was aborted: trial desk-1-000: s",
        ),
        (
            RobotBroke("its process is gone"),
            "unknown",
            "trial 0 may have moved the robot: its process is gone",
        ),
        (RobotFault("a motor is hot"), "failed", "trial 0 was failed: a motor is hot"),
    ],
)
def test_what_a_robot_raises_decides_what_becomes_of_the_trial(tmp_path, book, error, state, advice):
    class Raising(DeskRobot):
        def run(self, trial_id, x):
            self.ledger.start(trial_id, x)
            raise error

    campaign.advance(campaign_on(book, Raising(tmp_path, Fuse(-1))))
    assert book.trial(0).state == state
    assert status(book, None).advice.startswith(advice)
    past = campaign.history(book.trials(), DIMENSIONS)
    assert len(past.failed) == (state != "unknown")


def test_the_ledger_is_told_which_journal_grants_before_anything_moves(tmp_path, book):
    work = campaign_on(book, robot_in(tmp_path))
    campaign.advance(work)
    granted = next(event for event in book.events() if event.new is State.GRANTED)
    assert work.gate.granted == [("desk-1", "desk-1-000", granted.hash)]


def test_a_stopped_or_resting_robot_is_granted_nothing(tmp_path, book):
    robot = robot_in(tmp_path)
    for gate, phase, advice in (
        (DeskGate(robot, stopped="stopped by Ada: it smells"), Phase.STOPPED, "svaedc hardware clear desk"),
        (DeskGate(robot, rest=12.0), Phase.RESTS, "the robot rests 12 s more"),
    ):
        assert campaign.advance(campaign_on(book, robot, gate=gate)) is phase
        assert book.trial(0).state is State.APPROVED
        assert advice in status(book, None, gate).advice
    assert starts(tmp_path) == []
    assert campaign.advance(campaign_on(book, robot)) is Phase.READY
    assert starts(tmp_path) == ["desk-1-000"]


def test_a_plan_that_the_limits_reject_is_never_granted_and_another_controller_follows(tmp_path, book):
    robot = robot_in(tmp_path)
    campaign.advance(campaign_on(book, robot, gate=DeskGate(robot, objection="step 3: too fast")))
    assert book.trial(0).state is State.REJECTED
    assert "trial 0 was rejected: step 3: too fast" in status(book, None).advice
    assert campaign.advance(campaign_on(book, robot)) is Phase.READY
    assert starts(tmp_path) == ["desk-1-001"]
    assert campaign.history(book.trials(), DIMENSIONS).failed.tobytes() == book.trial(0).x.tobytes()


@pytest.mark.parametrize(
    ("bounds", "now", "reason"),
    [
        ({"until": "2026-01-01T00:00:00+00:00"}, {}, "the approval of operator: Ada held until 2026-01-01"),
        ({"limits": "k" * 64}, {}, "the robot's limits have changed since the approval of operator: Ada"),
        (
            {},
            {"cleared": "2999-01-01T00:00:00+00:00"},
            "the robot was stopped since the approval of operator",
        ),
        ({"until": "2999-01-01T00:00:00+00:00", "limits": "l" * 64}, {}, ""),
    ],
)
def test_an_approval_lapses_with_time_limits_and_stops(tmp_path, bounds, now, reason):
    identity = replace(IDENTITY, approval=Approval.OPERATOR)
    carry_out(tmp_path, identity=identity)
    robot = robot_in(tmp_path)
    with closing(opened(tmp_path)) as book:
        campaign.approve(book, book.trial(0), "operator: Ada", bounds)
        gate = DeskGate(robot, bounds={"limits": "l" * 64, "cleared": "", **now})
        phase = campaign.advance(campaign_on(book, robot, gate=gate))
        assert phase is (Phase.AWAITS_APPROVAL if reason else Phase.READY)
        assert len(starts(tmp_path)) == (not reason)
        assert reason in json.loads(book.events()[-1].body).get("reason", "")


def test_a_ledger_that_was_cut_off_vouches_for_nothing(tmp_path, book):
    class CutOff(DeskRobot):
        def motion(self, trial_id):
            return replace(super().motion(trial_id), certain=False)

    work = granted_by_a_dead_process(book, CutOff(tmp_path, Fuse(-1)))
    campaign.recover(work)
    assert book.trial(0).state is State.UNKNOWN
    assert "its ledger was cut off" in status(book, None).advice


def test_a_trial_id_the_ledger_knows_does_not_move_the_robot_again(tmp_path, book):
    robot = robot_in(tmp_path)
    robot.ledger.start("desk-1-000", np.zeros(DIMENSIONS))
    assert campaign.advance(campaign_on(book, robot)) is Phase.AWAITS_RESOLUTION
    assert "already moved the robot" in status(book, None).advice
    assert len(starts(tmp_path)) == 1
    assert campaign.advance(campaign_on(book, robot)) is Phase.AWAITS_RESOLUTION


def granted_by_a_dead_process(book, robot):
    work = campaign_on(book, robot)
    trial = campaign.propose(work)
    for state in (State.CHECKED, State.APPROVED, State.GRANTED):
        trial = campaign.record(book, trial, state, "test", {})
    return work


def test_a_granted_trial_that_never_started_is_approved_again(tmp_path, book):
    work = granted_by_a_dead_process(book, robot_in(tmp_path))
    campaign.recover(work)
    assert book.trial(0).state is State.APPROVED


def test_a_granted_trial_that_the_ledger_knows_is_unknown(tmp_path, book):
    work = granted_by_a_dead_process(book, robot_in(tmp_path))
    work.robot.ledger.start("desk-1-000", np.zeros(DIMENSIONS))
    campaign.recover(work)
    assert book.trial(0).state is State.UNKNOWN


def test_standing_follows_from_the_trials(tmp_path):
    carry_out(tmp_path)
    trials, _ = whole(tmp_path)
    assert (measured_trials(trials), planned_trials(IDENTITY)) == (4, 4)
    last = trials[-1]
    expected = {
        State.PROPOSED: Phase.READY,
        State.CHECKED: Phase.READY,
        State.APPROVED: Phase.READY,
        State.GRANTED: Phase.RUNNING,
        State.RUNNING: Phase.RUNNING,
        State.UNKNOWN: Phase.AWAITS_RESOLUTION,
        State.FAILED: Phase.READY,
        State.ABORTED: Phase.READY,
        State.REJECTED: Phase.READY,
        State.MEASURED: Phase.COMPLETE,
    }
    found = {state: phase_of((*trials[:-1], replace(last, state=state)), IDENTITY) for state in State}
    assert found == expected
