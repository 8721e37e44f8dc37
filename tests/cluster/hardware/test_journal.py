"""The journal: durable, exact, idempotent, and not silently editable."""

import json
import sqlite3
from contextlib import closing
from dataclasses import replace

import numpy as np
import pytest

from cluster.errors import UserError
from cluster.hardware import journal
from cluster.hardware.database import JournalCorrupt, JournalError
from cluster.hardware.events import replay
from cluster.hardware.identity import CampaignIdentity, IdentityMismatch
from cluster.hardware.journal import IllegalTransition, Journal, KeyReused, RobotTaken
from cluster.hardware.states import LEGAL, Approval, State
from tests.cluster.hardware.desk import IDENTITY, carry_out, now

X = np.array([0.1, 1.0 / 3.0, 5e-324])
PATHS = {
    State.PROPOSED: (),
    State.CHECKED: ("checked",),
    State.REJECTED: ("rejected",),
    State.APPROVED: ("checked", "approved"),
    State.GRANTED: ("checked", "approved", "granted"),
    State.RUNNING: ("checked", "approved", "granted", "running"),
    State.UNKNOWN: ("checked", "approved", "granted", "unknown"),
    State.MEASURED: ("checked", "approved", "granted", "running", "measured"),
    State.FAILED: ("checked", "approved", "granted", "running", "failed"),
    State.ABORTED: ("checked", "approved", "granted", "running", "aborted"),
}


@pytest.fixture
def book(tmp_path):
    journal.create(tmp_path / journal.FILE, "desk-1", IDENTITY)
    with closing(Journal(tmp_path / journal.FILE, now)) as opened:
        yield opened


def reopened(book):
    with closing(Journal(book.path, now)) as again:
        return again.trials()


def bring(book, number, state):
    book.propose(number, X, "random", "test", {})
    for new in PATHS[state]:
        body = {"f": 0.5, "y": 0.25} if new == "measured" else {}
        book.record(number, State(new), "test", body, f"{number}/{new}")


@pytest.mark.parametrize("old", list(State))
@pytest.mark.parametrize("new", list(State))
def test_exactly_the_legal_transitions_are_taken(book, old, new):
    bring(book, 0, old)
    if new in LEGAL[old]:
        book.record(0, new, "test", {"f": 1.0, "y": 0.0}, "again")
        assert book.trial(0).state is new
    else:
        with pytest.raises(IllegalTransition, match=f"from {old} to {new}; legal from there: "):
            book.record(0, new, "test", {"f": 1.0, "y": 0.0}, "again")
        assert book.trial(0).state is old


def test_a_controller_comes_back_bit_for_bit(book):
    book.propose(0, X, "random", "test", {})
    assert reopened(book)[0].x.tobytes() == X.tobytes()


def test_a_recorded_event_is_there_for_the_next_process(book):
    bring(book, 0, State.MEASURED)
    [trial] = reopened(book)
    assert (trial.state, trial.f, trial.y) == (State.MEASURED, 0.5, 0.25)


def test_an_amended_measurement_keeps_the_old_value_in_the_events(book):
    bring(book, 0, State.MEASURED)
    book.record(0, State.MEASURED, "operator", {"f": 0.75, "y": 0.5}, "amend")
    assert book.trial(0).measurement == (0.75, 0.5)
    assert [json.loads(e.body)["f"] for e in book.events() if e.new is State.MEASURED] == [0.5, 0.75]


@pytest.mark.parametrize("active", [State.GRANTED, State.RUNNING, State.UNKNOWN])
def test_a_second_trial_is_not_granted_while_one_may_move_the_robot(book, active):
    bring(book, 0, active)
    bring(book, 1, State.APPROVED)
    with pytest.raises(RobotTaken, match="granted, running or unknown"):
        book.record(1, State.GRANTED, "test", {}, "second")
    assert book.trial(1).state is State.APPROVED
    book.verify()


def test_the_one_active_trial_is_a_rule_of_the_database_itself(book):
    bring(book, 0, State.RUNNING)
    bring(book, 1, State.APPROVED)
    with closing(sqlite3.connect(book.path)) as raw, pytest.raises(sqlite3.IntegrityError):
        raw.execute("UPDATE trial SET state = 'granted' WHERE number = 1")


def test_a_repeated_request_gets_the_same_answer_and_adds_nothing(book):
    first = book.propose(0, X, "random", "test", {"n": 1})
    assert book.propose(0, X, "random", "test", {"n": 1}) == first
    checked = book.record(0, State.CHECKED, "test", {}, "key")
    book.record(0, State.APPROVED, "test", {}, "other key")
    assert book.record(0, State.CHECKED, "test", {}, "key") == checked
    assert len(book.events()) == 3


@pytest.mark.parametrize(
    "change", [{"who": "another"}, {"body": {"n": 2}}, {"new": State.REJECTED}, {"number": 1}]
)
def test_a_key_with_other_content_is_refused(book, change):
    bring(book, 0, State.PROPOSED)
    bring(book, 1, State.PROPOSED)
    request = {"number": 0, "new": State.CHECKED, "who": "test", "body": {"n": 1}, "idem": "key"}
    book.record(**request)
    with pytest.raises(KeyReused, match="'key' already stands for trial 0 -> checked"):
        book.record(**(request | change))


def test_not_a_number_never_enters_the_journal(book):
    bring(book, 0, State.RUNNING)
    with pytest.raises(ValueError, match="JSON"):
        book.record(0, State.MEASURED, "test", {"f": float("nan"), "y": 0.0}, "nan")
    assert book.trial(0).state is State.RUNNING


def test_the_trials_are_what_the_events_add_up_to(tmp_path):
    carry_out(tmp_path)
    with closing(Journal(tmp_path / journal.FILE, now)) as opened:
        assert tuple(replay(opened.events()).values()) == opened.trials()


TAMPERINGS = {
    "an altered body": "UPDATE event SET body = replace(body, '0.25', '0.26') WHERE new = 'measured'",
    "another author": "UPDATE event SET who = 'nobody' WHERE seq = 4",
    "another time": "UPDATE event SET at = '2000-01-01T00:00:00+00:00' WHERE seq = 5",
    "a removed event": "DELETE FROM event WHERE seq = 7",
    "a removed last event": "DELETE FROM event WHERE seq = (SELECT max(seq) FROM event)",
    "a moved event": "UPDATE event SET seq = 1000 WHERE seq = 3",
    "a state that is none": "UPDATE event SET new = 'flying' WHERE seq = 2",
    "another seed": "UPDATE campaign SET seed = 8",
    "an impossible seed": "UPDATE campaign SET seed = -1",
    "no campaign": "DELETE FROM campaign",
    "another objective": "UPDATE trial SET f = 9.0 WHERE number = 2",
    "another state": "UPDATE trial SET state = 'approved' WHERE number = 2",
    "another controller": "UPDATE trial SET x_hex = '0000000000000000' WHERE number = 0",
    "a removed trial": "DELETE FROM trial WHERE number = 3",
    "an empty table": "DELETE FROM trial",
}


@pytest.mark.parametrize("statement", TAMPERINGS.values(), ids=TAMPERINGS.keys())
def test_an_edited_journal_is_refused(tmp_path, statement):
    carry_out(tmp_path)
    with closing(sqlite3.connect(tmp_path / journal.FILE)) as raw, raw:
        assert raw.execute(statement).rowcount > 0
    with pytest.raises(JournalCorrupt, match=r"damaged: .*nothing will be granted"):
        Journal(tmp_path / journal.FILE, now)


def test_nothing_moves_on_an_edited_journal(tmp_path):
    carry_out(tmp_path)
    before = (tmp_path / "starts.jsonl").read_bytes()
    with closing(sqlite3.connect(tmp_path / journal.FILE)) as raw, raw:
        raw.execute("DELETE FROM event WHERE trial = 3")
        raw.execute("DELETE FROM trial WHERE number = 3")
        raw.execute("UPDATE trial SET f = 9.0 WHERE number = 2")
    with pytest.raises(JournalCorrupt):
        carry_out(tmp_path)
    assert (tmp_path / "starts.jsonl").read_bytes() == before


@pytest.mark.parametrize(
    "content", [b"SQLite format 3", b'{"evidence":', b'"kind":"random"', b"CREATE TABLE event"]
)
def test_overwritten_bytes_are_refused(tmp_path, content):
    carry_out(tmp_path)
    path = tmp_path / journal.FILE
    whole = path.read_bytes()
    assert content in whole
    path.write_bytes(whole.replace(content, b"\xa5" * len(content)))
    with pytest.raises(JournalCorrupt, match="damaged"):
        Journal(path, now)


def test_a_folder_without_campaign_is_named(tmp_path):
    with pytest.raises(JournalError, match=f"no campaign in {tmp_path}"):
        Journal(tmp_path / journal.FILE, now)


def test_an_unknown_trial_is_named_with_how_many_there_are(book):
    bring(book, 0, State.PROPOSED)
    with pytest.raises(JournalError, match=r"no trial 5 in .* it has 1"):
        book.trial(5)


def test_a_full_disk_stops_before_anything_is_granted(book):
    bring(book, 0, State.APPROVED)
    pages = book._connection.execute("PRAGMA page_count").fetchone()[0]
    book._connection.execute(f"PRAGMA max_page_count = {pages}")
    with pytest.raises(JournalError, match="full; it needs a writable local disk with space left"):
        book.record(0, State.GRANTED, "test", {"large": "x" * 100_000}, "key")
    assert reopened(book)[0].state is State.APPROVED


def test_creating_twice_keeps_the_first_campaign(book):
    bring(book, 0, State.PROPOSED)
    journal.create(book.path, "desk-2", replace(IDENTITY, seed=8))
    with closing(Journal(book.path, now)) as again:
        assert (again.name, again.identity, len(again.trials())) == ("desk-1", IDENTITY, 1)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("robot", "other"),
        ("setup", "other"),
        ("method", "se"),
        ("seed", 8),
        ("model", "ab"),
        ("pool", 11),
        ("trials", 3),
        ("approval", Approval.OPERATOR),
    ],
)
def test_another_campaign_is_refused_naming_the_field(field, value):
    with pytest.raises(IdentityMismatch, match=f"here holds a campaign with {field} "):
        IDENTITY.require(replace(IDENTITY, **{field: value}), "here")


@pytest.mark.parametrize(("field", "value"), [("seed", -1), ("trials", -1), ("pool", 0)])
def test_an_impossible_identity_is_refused(field, value):
    with pytest.raises(ValueError, match=f"{field} must be at least"):
        replace(IDENTITY, **{field: value})


def test_every_error_of_the_journal_is_one_a_user_can_read():
    assert issubclass(JournalError, UserError)
    assert all(
        issubclass(e, JournalError) for e in (JournalCorrupt, IllegalTransition, RobotTaken, KeyReused)
    )


def test_an_equal_identity_is_accepted_by_itself():
    twin = CampaignIdentity(*(getattr(IDENTITY, field) for field in IDENTITY.__dataclass_fields__))
    assert IDENTITY.require(twin, "here") is None
