"""A setup as a value: its gap levels, and the conditions it refuses."""

from dataclasses import replace

import pytest

from workers import setups
from workers.setups.setup import Setup
from workers.tasks.stop import STOPPED

FRANKA = setups.load("franka")


def test_a_level_that_is_written_out_keeps_all_else_in_the_middle():
    gap = FRANKA.gap("object1_mass=1.5:2.5").intervals
    assert gap["object1_mass"] == (1.5, 2.5)
    others = {name: interval for name, interval in gap.items() if name != "object1_mass"}
    middle = FRANKA.physics.middle()
    assert others == {name: (middle[name], middle[name]) for name in others}
    assert gap.keys() == FRANKA.physics.intervals.keys()


def test_a_stop_rule_adds_a_condition_after_those_of_the_task():
    stopping = replace(FRANKA, stop=lambda _: "")
    assert isinstance(stopping, Setup)
    assert stopping.conditions == (*FRANKA.task.conditions, STOPPED)
    assert FRANKA.conditions == FRANKA.task.conditions


def test_setup_is_offered_by_the_package_without_being_imported_first():
    assert setups.Setup is Setup
    with pytest.raises(AttributeError, match="no attribute 'Setups'"):
        _ = setups.Setups
