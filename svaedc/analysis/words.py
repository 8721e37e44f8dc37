"""Numbers and names as a sentence has them."""

import math
from collections.abc import Sequence


def quantity(count: int, noun: str) -> str:
    """Say how many there are: 1 run, 2 runs.

    Args:
        count: Of them.
        noun: In the singular; its plural ends in s.

    Returns:
        Number and noun.
    """
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def enumeration(names: Sequence[str]) -> str:
    """Join names as a sentence does: a; a and b; a, b and c."""
    *others, last = names
    return f"{', '.join(others)} and {last}" if others else last


def places(*values: float) -> int:
    """How many decimal places show two digits of the largest of these values; 2 where all are zero."""
    largest = max(map(abs, values))
    return max(0, 1 - math.floor(math.log10(largest))) if largest > 0 else 2
