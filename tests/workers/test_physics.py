"""Ranges of physics: as they are written out, as gap levels of a setup, and what is drawn from them."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from workers import setups
from workers.physics import PhysicsRanges, around, ranges
from workers.randomness import Stream, generator

numbers = st.floats(0, 1e6)
intervals = st.tuples(numbers, numbers).map(lambda pair: (min(pair), max(pair)))


@pytest.fixture(scope="module")
def setup():
    return setups.load("daisy-27d")


@given(st.dictionaries(st.sampled_from(("mass", "friction", "restitution")), intervals, min_size=1))
def test_ranges_that_are_written_and_read_are_the_same(written):
    assert ranges(str(PhysicsRanges(written))).intervals == written


def test_equal_ranges_have_one_text():
    assert str(ranges(" b=2 , a=1:2.50")) == str(ranges("a=1.0:2.5,b=2:2.0")) == "a=1.0:2.5,b=2.0:2.0"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("friction=2:1", r"friction must satisfy low <= high, got \[2.0, 1.0\]"),
        ("friction=nan", "physics range of friction must be two finite numbers"),
        ("friction=1:inf", "physics range of friction must be two finite numbers"),
        ("friction=", "must be written NAME=LOW:HIGH or NAME=VALUE, got 'friction='"),
        ("friction=1:", "must be written NAME=LOW:HIGH or NAME=VALUE, got 'friction=1:'"),
        ("friction=slippery", "got 'friction=slippery'"),
        ("friction=1,,", "must be written NAME=LOW:HIGH or NAME=VALUE, got ''"),
        ("friction=1,friction=2", "friction must be given once"),
    ],
)
def test_a_range_that_is_none_is_refused_with_its_text(text, message):
    with pytest.raises(ValueError, match=message):
        ranges(text)


def test_an_explicit_gap_has_the_ranges_written_out_and_all_else_at_its_middle(setup):
    gap = setup.gap("friction=1:2.5,link_damping=0.2")
    assert gap.intervals["friction"] == (1.0, 2.5)
    assert gap.intervals["link_damping"] == (0.2, 0.2)
    assert gap.intervals["restitution"] == pytest.approx((0.05, 0.05))
    assert gap.intervals.keys() == setup.physics.intervals.keys()


def test_an_explicit_gap_of_an_unknown_parameter_is_refused_with_the_nearest(setup):
    with pytest.raises(LookupError, match="unknown physics parameter 'fricton'; did you mean 'friction'"):
        setup.gap("fricton=1:2")


def test_physics_stays_within_its_ranges_and_reaches_both_ends():
    ranges = around({"mass": 2.0, "friction": 0.3}, 0.05)
    draws = [ranges.draw(generator(0, Stream.PHYSICS, index)) for index in range(400)]
    masses = [draw["mass"] for draw in draws]
    assert 1.9 <= min(masses) < 1.91
    assert 2.09 < max(masses) <= 2.1


def test_physics_does_not_depend_on_the_order_of_declaration():
    """A dataset's identity stores the ranges sorted by name, and must be able to draw them again."""
    one = PhysicsRanges({"mass": (1.0, 2.0), "friction": (0.1, 0.2)})
    other = PhysicsRanges({"friction": (0.1, 0.2), "mass": (1.0, 2.0)})
    assert one.draw(generator(0, Stream.PHYSICS, 3)) == other.draw(generator(0, Stream.PHYSICS, 3))


def test_ranges_cannot_be_changed_afterwards():
    ranges = around({"mass": 2.0}, 0.05)
    with pytest.raises(TypeError):
        ranges.intervals["mass"] = (0.0, 1.0)
