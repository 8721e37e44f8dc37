"""What differs between two setups is said in words."""

import json
from dataclasses import replace

from workers import setups
from workers.physics import PhysicsRanges
from workers.setups.declared import changes, declaration, list_changes, what_changed

FRANKA = setups.load("franka")


def differing(**fields):
    return list(changes(declaration(FRANKA), declaration(replace(FRANKA, **fields))))


def test_a_declaration_is_plain_json_and_the_same_every_time():
    declared = declaration(FRANKA)
    assert json.loads(json.dumps(declared, allow_nan=False)) == declared == declaration(setups.load("franka"))
    assert "broken" not in declaration(setups.load("quadratic-30d"))


def test_of_two_setups_that_are_the_same_nothing_is_said_but_that_it_is_the_code():
    assert differing() == []
    assert what_changed([], "setup") == "nothing that its setup declares: its code did"


def test_every_entry_that_differs_is_named_with_what_it_was_and_what_it_is():
    first, *rest = FRANKA.observation
    moved = replace(first, high=9.0)
    [change] = differing(observation=(moved, *rest))
    assert str(change) == f"observation: {first.name}: ['{first.unit}', {first.low}, {first.high}] and " + (
        f"['{first.unit}', {first.low}, 9.0]"
    )
    assert differing(observation=tuple(rest))[0].since.endswith("], is none")
    assert (
        what_changed(differing(horizon=7, success=0.5), "setup")
        == "horizon was 500, is 7; success was 0.4, is 0.5"
    )
    physics = PhysicsRanges({**FRANKA.physics.intervals, "object1_mass": (1.0, 2.0)})
    [change] = differing(physics=physics)
    assert change.since.startswith("physics: object1_mass was [1.9")
    assert change.since.endswith("is [1.0, 2.0]")
    [change] = differing(gaps={**FRANKA.gaps, "paper": FRANKA.gaps["wide"]})[:1]
    assert change.what.startswith("gaps: paper: ")


def test_another_order_is_a_difference():
    [change] = differing(observation=FRANKA.observation[::-1])
    assert change.what == "the order of observation"


def test_long_values_are_cut():
    [change] = changes({"conditions": ["x" * 100]}, {"conditions": []})
    assert len(change.one) == 80


def test_of_many_differences_the_first_few_are_told_and_the_rest_counted():
    many = list(changes(declaration(FRANKA), declaration(setups.load("yumi"))))
    assert list_changes(many).endswith(f"; and {len(many) - 4} more")
    assert list_changes(many).count(";") == 4
    assert list_changes(many[:2]) == "; ".join(map(str, many[:2]))
    assert list_changes([]) == ""
