"""What a run's seed is for: results that are reported never come from seeds that choices were made on."""

from collections.abc import Iterable
from typing import Final, Literal

Purpose = Literal["reporting", "tuning"]

FIRST_TUNING: Final = 1_000
"""Seeds from here on are for choosing settings, those below for results; a study reports 0 to 49."""


def purpose(seed: int) -> Purpose:
    """What a seed may be used for."""
    return "tuning" if seed >= FIRST_TUNING else "reporting"


def common_purpose(seeds: Iterable[int]) -> Purpose:
    """What all of these seeds may be used for.

    Raises:
        ValueError: Some are for reporting and some for tuning, or there are none.
    """
    seeds = sorted(seeds)
    if not seeds:
        raise ValueError("a purpose needs at least one seed, got none")
    if purpose(seeds[0]) != purpose(seeds[-1]):
        raise ValueError(
            f"seeds must be all below {FIRST_TUNING}, for reporting, or all from there on, for tuning, "
            f"got {seeds[0]} to {seeds[-1]}: settings chosen on runs that are reported flatter them"
        )
    return purpose(seeds[0])
