"""How sure a mean over runs is."""

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy import stats

RESAMPLES = 5_000


@dataclass(frozen=True)
class Estimate:
    """A mean over runs and its interval, NaN where too few runs tell."""

    mean: float
    low: float
    high: float


def student_t(values: Float[np.ndarray, " runs"], confidence: float) -> Estimate:
    r"""Mean \pm t_{n-1} s / \sqrt n of the values that are not NaN."""
    values = values[~np.isnan(values)]
    n = len(values)
    if n < 2:
        return Estimate(float(values.mean()) if n else math.nan, math.nan, math.nan)
    mean = float(values.mean())
    half = float(stats.t.ppf((1 + confidence) / 2, n - 1) * values.std(ddof=1) / math.sqrt(n))
    return Estimate(mean, mean - half, mean + half)


def bootstrap(
    values: Float[np.ndarray, "runs columns"], confidence: float, rng: np.random.Generator
) -> tuple[Estimate, ...]:
    """Mean of each column, with the percentile interval over resampled runs."""
    n = len(values)
    if n < 2:
        means = values.mean(axis=0) if n else np.full(values.shape[1], math.nan)
        return tuple(Estimate(float(mean), math.nan, math.nan) for mean in means)
    # A resample's mean is the mean weighted by how often each run was drawn.
    weights = rng.multinomial(n, np.full(n, 1 / n), size=RESAMPLES) / n
    tail = (1 - confidence) / 2
    low, high = np.quantile(weights @ values, [tail, 1 - tail], axis=0)
    return tuple(map(Estimate, values.mean(axis=0).tolist(), low.tolist(), high.tolist()))
