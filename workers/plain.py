"""Plain values out of what a user's module states: NumPy's scalars become Python's, the rest is refused."""

import math
from collections import Counter
from collections.abc import Iterable
from typing import Any

from workers.user_code import UserCodeError


def plain(value: Any) -> Any:
    """The Python value of a scalar of NumPy or torch; anything else as it is."""
    return (
        value.item() if callable(getattr(value, "item", None)) and not getattr(value, "shape", ()) else value
    )


def finite(value: Any, name: str) -> float | int:
    """Take a finite number.

    Args:
        value: what was stated.
        name: of it, for the error.

    Returns:
        The number as Python's; an integer stays one.

    Raises:
        UserCodeError: it is no number, or not finite.
    """
    number = plain(value)
    if isinstance(number, bool) or not isinstance(number, int | float) or not math.isfinite(number):
        raise UserCodeError(f"{name} must be a finite number, got {value!r}")
    return number


def positive(value: Any, name: str) -> float | int:
    """Take a finite number above 0.

    Args:
        value: what was stated.
        name: of it, for the error.

    Returns:
        The number as Python's.

    Raises:
        UserCodeError: it is none, or not above 0.
    """
    number = finite(value, name)
    if number <= 0:
        raise UserCodeError(f"{name} must be above 0, got {value!r}")
    return number


def count(value: Any, name: str) -> int:
    """Take a whole number of at least 1.

    Args:
        value: what was stated; 500.0 counts as 500.
        name: of it, for the error.

    Returns:
        The number as Python's.

    Raises:
        UserCodeError: it is no whole number, or below 1.
    """
    number = finite(value, name)
    if number != int(number) or number < 1:
        raise UserCodeError(f"{name} must be a whole number of at least 1, got {value!r}")
    return int(number)


def interval(value: Any, name: str) -> tuple[float | int, float | int]:
    """Take two finite numbers of which the first is the lower.

    Args:
        value: a pair, such as a tuple or an array of two.
        name: of it, for the error.

    Returns:
        Low and high as Python's numbers.

    Raises:
        UserCodeError: it is no such pair.
    """
    pair = list(value) if isinstance(value, Iterable) and not isinstance(value, str) else []
    if len(pair) != 2:
        raise UserCodeError(f"{name} must be two numbers (low, high), got {value!r}")
    low, high = finite(pair[0], f"low of {name}"), finite(pair[1], f"high of {name}")
    if not low < high:
        raise UserCodeError(f"{name} must satisfy low < high, got [{low}, {high}]")
    return low, high


def text(value: Any, name: str) -> str:
    """Take a text that is not empty.

    Args:
        value: what was stated.
        name: of it, for the error.

    Returns:
        The text as Python's.

    Raises:
        UserCodeError: it is no text, or empty.
    """
    if not isinstance(value, str) or not value:
        raise UserCodeError(f"{name} must be a text that is not empty, got {value!r}")
    return str(value)


def distinct(names: Iterable[str], what: str) -> None:
    """Refuse names of which some are the same.

    Args:
        names: what is named.
        what: they are, for the error.

    Raises:
        UserCodeError: a name is there more than once.
    """
    double = [name for name, times in Counter(names).items() if times > 1]
    if double:
        raise UserCodeError(f"{what} must have names that differ, got {double[0]!r} twice; rename one")
