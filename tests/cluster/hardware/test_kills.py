"""`kill -9` at every point of a campaign, then the same command again: nothing lost, nothing repeated."""

from contextlib import closing

import numpy as np
import pytest

from cluster.hardware import campaign, journal
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.journal import RobotTaken
from cluster.hardware.states import Approval, State
from cluster.hardware.status import Phase
from tests.cluster.hardware.desk import carry_out, objective, opened, starts
from workers.hardware.ledger import MotionLedger

SHORT = CampaignIdentity("desk", "desk", "climb", 7, "", 10, 1, Approval.POLICY)
POINTS_PER_TRIAL = 15
POINTS = 2 + 3 * POINTS_PER_TRIAL
SIGKILLED = -9


def run(processes, folder, burns_at):
    process = processes.Process(target=carry_out, args=(folder, burns_at, 0.0, frozenset(), SHORT))
    process.start()
    process.join()
    return process.exitcode


def journal_of(folder):
    with closing(opened(folder)) as book:
        return book.trials(), book.events()


def resolve(folder):
    """An operator who saw the robot: a trial that ran is measured, one that never began is aborted."""
    with closing(opened(folder)) as book:
        [trial] = [trial for trial in book.trials() if trial.state is State.UNKNOWN]
        if MotionLedger(folder / "starts.jsonl").motion(f"desk-1-{trial.number:03d}").started:
            seen = {"f": objective(trial.x), "y": 0.25, "note": "seen"}
            return campaign.record(book, trial, State.MEASURED, "operator: Ada", seen)
        return campaign.record(book, trial, State.ABORTED, "operator: Ada", {"note": "it never moved"})


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("undisturbed")
    standing, names = carry_out(folder, identity=SHORT)
    assert standing is Phase.COMPLETE
    assert len(names) == POINTS
    return journal_of(folder)[0], names


def test_the_points_lie_around_every_write_and_in_every_motion(undisturbed):
    _, names = undisturbed
    states = ["proposed", "checked", "approved", "granted", "running"]
    writes = [f"{side} {state}" for state in states for side in ("before", "after")]
    motion = ["before motion", "in motion", "after motion"]
    assert names == ["locked", "created", *3 * [*writes, *motion, "before measured", "after measured"]]


@pytest.mark.parametrize("point", range(POINTS))
def test_a_kill_loses_nothing_and_repeats_nothing(processes, tmp_path, undisturbed, point):
    expected, names = undisturbed
    assert run(processes, tmp_path, point) == SIGKILLED
    survived = journal_of(tmp_path)[1] if point > 0 else ()
    moved = starts(tmp_path)

    may_have_moved = names[point] in {
        "after running", "before motion", "in motion", "after motion", "before measured"
    }  # fmt: skip
    standing, _ = carry_out(tmp_path, identity=SHORT)
    assert standing is (Phase.AWAITS_RESOLUTION if may_have_moved else Phase.COMPLETE)
    if may_have_moved:
        assert starts(tmp_path) == moved
        resolve(tmp_path)
        assert carry_out(tmp_path, identity=SHORT)[0] is Phase.COMPLETE

    trials, events = journal_of(tmp_path)
    assert events[: len(survived)] == survived
    assert len(set(starts(tmp_path))) == len(starts(tmp_path))
    if all(trial.state is State.MEASURED for trial in trials):
        assert [(t.x_hex, t.f) for t in trials] == [(t.x_hex, t.f) for t in expected]
    else:
        reached = next(trial.number for trial in trials if trial.state is State.ABORTED)
        assert [t.x_hex for t in trials[: reached + 1]] == [t.x_hex for t in expected[: reached + 1]]


def grant(folder, number, barrier, answers):
    with closing(opened(folder)) as book:
        trial = book.trial(number)
        barrier.wait()
        try:
            campaign.record(book, trial, State.GRANTED, f"process {number}", {})
        except RobotTaken:
            answers.put("taken")
        else:
            answers.put("granted")


@pytest.mark.parametrize("attempt", range(5))
def test_of_two_processes_that_grant_at_once_one_wins(processes, tmp_path, attempt):
    journal.create(tmp_path / journal.FILE, f"desk-{attempt}", SHORT)
    with closing(opened(tmp_path)) as book:
        for number in range(2):
            book.propose(number, np.full(5, 0.5), "random", "test", {})
            for state in (State.CHECKED, State.APPROVED):
                campaign.record(book, book.trial(number), state, "test", {})
    barrier, answers = processes.Barrier(2), processes.Queue()
    both = [processes.Process(target=grant, args=(tmp_path, n, barrier, answers)) for n in range(2)]
    for process in both:
        process.start()
    assert sorted(answers.get(timeout=180) for _ in both) == ["granted", "taken"]
    for process in both:
        process.join()
    with closing(opened(tmp_path)) as book:
        assert sorted(trial.state for trial in book.trials()) == [State.APPROVED, State.GRANTED]
