"""The table of legal transitions, against the one in the design."""

import pytest

from cluster.hardware.states import ACTIVE, IMPORTED, LEGAL, TERMINAL, State, legal

DESIGN = {
    (None, "proposed"),
    ("proposed", "checked"),
    ("proposed", "rejected"),
    ("checked", "rejected"),
    ("checked", "approved"),
    ("approved", "granted"),
    ("approved", "checked"),  # withdrawn by a person, or lapsed
    ("approved", "rejected"),
    ("granted", "approved"),
    ("granted", "running"),
    ("granted", "unknown"),
    ("running", "unknown"),
    ("running", "measured"),
    ("running", "aborted"),
    ("running", "failed"),
    ("unknown", "measured"),
    ("unknown", "aborted"),
    ("unknown", "failed"),
    ("measured", "measured"),
}


def test_table_has_exactly_the_designed_transitions():
    assert {(old, new) for old in LEGAL for new in LEGAL[old]} == DESIGN


def test_every_state_has_its_row():
    assert set(LEGAL) == {None, *State}


@pytest.mark.parametrize("state", sorted(TERMINAL))
def test_a_terminal_state_leads_nowhere_but_a_measurement_to_its_amendment(state):
    assert LEGAL[state] <= {state}


@pytest.mark.parametrize("state", [State.RUNNING, State.UNKNOWN, *sorted(TERMINAL)])
def test_what_may_have_moved_the_robot_never_runs_again(state):
    reached, frontier = set(), {state}
    while frontier:
        reached |= frontier
        frontier = {new for old in frontier for new in LEGAL[old]} - reached
    assert not reached & {State.APPROVED, State.GRANTED}
    assert (state is State.RUNNING) == (State.RUNNING in reached)


def test_only_states_in_which_the_robot_may_move_are_active():
    assert {State.GRANTED, State.RUNNING, State.UNKNOWN} == ACTIVE
    assert State.RUNNING not in LEGAL[State.PROPOSED]


def test_what_was_imported_is_measured_at_once_and_can_only_be_amended():
    assert legal(State.PROPOSED, IMPORTED) == {State.MEASURED}
    assert legal(State.MEASURED, IMPORTED) == {State.MEASURED}
    assert legal(State.PROPOSED, "random") == LEGAL[State.PROPOSED]
