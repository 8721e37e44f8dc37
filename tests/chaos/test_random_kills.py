"""Many kills at random moments of campaigns on a paced robot; the moments come from a seeded generator."""

import numpy as np
import pytest

from cluster.hardware.database import JournalError
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.states import ACTIVE, TERMINAL, Approval, State
from tests.cluster.hardware.desk import carry_out, starts
from tests.cluster.hardware.test_kills import SIGKILLED, journal_of, resolve

KILLS = 150
PACE_SECONDS = 0.01
LONGEST_LIFE_SECONDS = 0.3
PLAN = CampaignIdentity("desk", "desk", "climb", 11, "", 10, 6, Approval.POLICY)


def lived(processes, folder, seconds):
    """One start command that is killed after so many seconds, if it has not ended by then; how it ended."""
    process = processes.Process(target=carry_out, args=(folder, -1, PACE_SECONDS, frozenset(), PLAN))
    process.start()
    process.join(seconds)
    process.kill()
    process.join()
    return process.exitcode


def seen(folder):
    """Trials and events; nothing of a campaign whose creation was cut short."""
    try:
        return journal_of(folder)
    except JournalError:
        # Only a campaign that never moved anything may be absent.
        assert starts(folder) == []
        return (), ()


def measured_before_any_abortion(trials):
    aborted = [trial.number for trial in trials if trial.state is State.ABORTED]
    return [(trial.x_hex, trial.f) for trial in trials[: min(aborted, default=len(trials))]]


@pytest.mark.chaos
def test_no_random_kill_loses_or_repeats_anything(processes, tmp_path):
    rng = np.random.default_rng(0)
    (tmp_path / "undisturbed").mkdir()
    carry_out(tmp_path / "undisturbed", identity=PLAN)
    expected = [(trial.x_hex, trial.f) for trial in journal_of(tmp_path / "undisturbed")[0]]
    kills, resolved, finished = 0, 0, []
    while kills < KILLS or not finished:
        folder = tmp_path / f"campaign-{len(finished)}"
        folder.mkdir(exist_ok=True)
        before = seen(folder)[1]
        kills += lived(processes, folder, rng.uniform(0.0, LONGEST_LIFE_SECONDS)) == SIGKILLED
        trials, events = seen(folder)
        moved = starts(folder)
        assert events[: len(before)] == before
        assert len(set(moved)) == len(moved)
        assert sum(trial.state in ACTIVE for trial in trials) <= 1
        if any(trial.state is State.UNKNOWN for trial in trials):
            assert lived(processes, folder, 30.0) == 0
            assert starts(folder) == moved
            resolve(folder)
            resolved += 1
        elif sum(trial.state is State.MEASURED for trial in trials) == len(expected):
            assert {trial.state for trial in trials} <= TERMINAL
            prefix = measured_before_any_abortion(trials)
            assert prefix == expected[: len(prefix)]
            finished.append(folder)
    print(f"{kills} kills, {len(finished)} campaigns finished, {resolved} unknown trials resolved")
    assert resolved > 0
