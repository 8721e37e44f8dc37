"""Laws of the journal under any sequence of requests, found by a state machine."""

import shutil
import sqlite3
import tempfile
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from cluster.hardware import journal
from cluster.hardware.database import JournalCorrupt
from cluster.hardware.events import broken_link, replay
from cluster.hardware.journal import IllegalTransition, Journal, KeyReused, RobotTaken
from cluster.hardware.states import ACTIVE, LEGAL, State
from tests.cluster.hardware.desk import IDENTITY, carry_out, now

BODY = {"f": 0.5, "y": 0.25}
numbers = st.integers(0, 3)


class JournalMachine(RuleBasedStateMachine):
    """Requests of every kind against one journal, beside a model of thirty lines."""

    def __init__(self):
        super().__init__()
        self.folder = Path(tempfile.mkdtemp())
        self.path = self.folder / journal.FILE
        journal.create(self.path, "desk-1", IDENTITY)
        self.book = Journal(self.path, now)
        self.states: dict[int, State] = {}
        self.answers: list[tuple[tuple, object]] = []

    def teardown(self):
        self.book.close()
        shutil.rmtree(self.folder)

    @rule(number=numbers, x=st.floats(0, 1))
    def propose(self, number, x):
        if number not in self.states:
            self.book.propose(number, np.array([x]), "random", "test", {})
            self.states[number] = State.PROPOSED
        else:
            with pytest.raises(KeyReused):
                self.book.propose(number, np.array([x]), "random", "somebody else", {})

    @rule(number=numbers, new=st.sampled_from(sorted(set(State) - {State.PROPOSED})))
    def move(self, number, new):
        old = self.states.get(number)
        request = (number, new, "test", BODY, f"key {len(self.answers)} {number} {new}")
        others = {state for other, state in self.states.items() if other != number}
        if new not in LEGAL[old]:
            with pytest.raises(IllegalTransition):
                self.book.record(*request)
        elif new in ACTIVE and others & ACTIVE:
            with pytest.raises(RobotTaken):
                self.book.record(*request)
        else:
            self.answers.append((request, self.book.record(*request)))
            self.states[number] = new

    @precondition(lambda self: self.answers)
    @rule(data=st.data())
    def repeat(self, data):
        request, answer = data.draw(st.sampled_from(self.answers))
        assert self.book.record(*request) == answer

    @precondition(lambda self: self.answers)
    @rule(data=st.data())
    def reuse_a_key(self, data):
        (number, new, who, _, idem), _ = data.draw(st.sampled_from(self.answers))
        with pytest.raises(KeyReused):
            self.book.record(number, new, who, {"f": 9.0, "y": 0.0}, idem)

    @rule()
    def another_process_opens_it(self):
        self.book.close()
        self.book = Journal(self.path, now)

    @invariant()
    def the_journal_says_what_was_answered(self):
        assert {trial.number: trial.state for trial in self.book.trials()} == self.states

    @invariant()
    def at_most_one_trial_may_move_the_robot(self):
        assert sum(trial.state in ACTIVE for trial in self.book.trials()) <= 1

    @invariant()
    def the_chain_is_whole_and_adds_up_to_the_trials(self):
        events = self.book.events()
        assert broken_link(events, IDENTITY.genesis("desk-1")) is None
        assert replay(events) == {trial.number: trial for trial in self.book.trials()}


JournalMachine.TestCase.settings = settings(
    max_examples=25, stateful_step_count=25, deadline=None, suppress_health_check=[HealthCheck.too_slow]
)
TestJournal = JournalMachine.TestCase


class JournalAtLength(JournalMachine):
    """The same, forty times as often."""


JournalAtLength.TestCase.settings = settings(JournalMachine.TestCase.settings, max_examples=1000)
TestJournalAtLength = pytest.mark.slow(JournalAtLength.TestCase)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    carry_out(folder)
    return folder


@settings(max_examples=40, deadline=None)
@given(data=st.data())
@pytest.mark.slow
def test_any_change_of_any_event_is_noticed(finished, data):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / journal.FILE
        shutil.copy(finished / journal.FILE, path)
        with closing(sqlite3.connect(path)) as raw, raw:
            columns = [row[1] for row in raw.execute("PRAGMA table_info(event)")]
            seq = data.draw(st.integers(1, raw.execute("SELECT max(seq) FROM event").fetchone()[0]))
            column = data.draw(st.sampled_from(columns))
            [old] = raw.execute(f"SELECT {column} FROM event WHERE seq = ?", (seq,)).fetchone()
            new = data.draw(
                st.integers(1000, 2**62)
                if isinstance(old, int)
                else st.text(max_size=9).filter(lambda t: t != old)
            )
            raw.execute(f"UPDATE event SET {column} = ? WHERE seq = ?", (new, seq))
        with pytest.raises(JournalCorrupt):
            Journal(path, now)
