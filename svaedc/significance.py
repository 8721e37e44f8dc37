"""Whether paired differences could be chance: sign-flip tests, and Holm's correction for many of them."""

from typing import Final

import numpy as np
from jaxtyping import Float

FLIPS: Final = 10_000
"""Random sign patterns; the smallest p value is 1 / (FLIPS + 1)."""
_EXACT_UP_TO: Final = 13
"""Runs with whose fewer than FLIPS sign patterns all are tried."""


def sign_flip(
    differences: Float[np.ndarray, "runs columns"], rng: np.random.Generator
) -> Float[np.ndarray, " columns"]:
    """Two-sided p value of each column's mean, if the sign of every run's difference were a coin's.

    The test behind a paired comparison that assumes no distribution: under the null hypothesis the two
    methods could have swapped names in any run. NaN with fewer than two runs, or where a difference is NaN.
    """
    n = len(differences)
    if n < 2:
        return np.full(differences.shape[1], np.nan)
    observed = np.abs(differences.mean(axis=0))
    found = np.abs(_signs(n, rng) @ differences) / n
    # Sums in another order differ in their last bits; those count as equal.
    as_large = found >= observed * (1 - 1e-9)
    p = as_large.mean(axis=0) if n <= _EXACT_UP_TO else (1 + as_large.sum(axis=0)) / (1 + FLIPS)
    return np.where(np.isnan(observed), np.nan, p)


def holm(p: Float[np.ndarray, "tests columns"]) -> Float[np.ndarray, "tests columns"]:
    """The p values of each column corrected for their number, after Holm (1979).

    Below alpha, the corrected ones are false for any test with a probability of at most alpha, however the
    tests depend on each other. Tests without a p value are not counted.
    """
    order = np.argsort(p, axis=0)  # NaN comes last
    ranked = np.take_along_axis(p, order, axis=0)
    remaining = (~np.isnan(p)).sum(axis=0) - np.arange(len(p))[:, None]
    corrected = np.minimum(np.fmax.accumulate(ranked * remaining, axis=0), 1)
    corrected = np.where(np.isnan(ranked), np.nan, corrected)
    result = np.empty_like(p)
    np.put_along_axis(result, order, corrected, axis=0)
    return result


def _signs(n: int, rng: np.random.Generator) -> Float[np.ndarray, "flips runs"]:
    if n > _EXACT_UP_TO:
        return rng.integers(0, 2, (FLIPS, n)) * 2.0 - 1.0
    return (np.arange(2**n)[:, None] >> np.arange(n)) % 2 * 2.0 - 1.0
