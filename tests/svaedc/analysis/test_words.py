"""Numbers and names as a sentence has them."""

import pytest

from svaedc.analysis.words import enumeration, places, quantity


def test_one_is_singular_and_all_else_plural():
    assert [quantity(count, "run") for count in (0, 1, 2)] == ["0 runs", "1 run", "2 runs"]


def test_names_are_joined_as_in_a_sentence():
    assert [enumeration(names) for names in (["a"], ["a", "b"], ["a", "b", "c"])] == [
        "a",
        "a and b",
        "a, b and c",
    ]


@pytest.mark.parametrize(
    ("values", "count"),
    [((0.12, -0.05), 2), ((12.3,), 0), ((-4567.0,), 0), ((0.0031,), 4), ((0.0,), 2), ((1.0,), 1)],
)
def test_two_digits_of_the_largest_value_are_shown(values, count):
    assert places(*values) == count
