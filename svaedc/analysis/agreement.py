"""How far two simulations of the same controllers agree, and what becomes of the best of one in the other."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.stats import ks_2samp, spearmanr

BEST = 20
"""What becomes of so many of the best controllers is told."""


@dataclass(frozen=True)
class Agreement:
    """One measure in two simulations of the same controllers.

    Attributes:
        name: of the measure.
        means: in the one and the other.
        spearman: correlation of the ranks, in [−1, 1]: whether the controllers come in the same order; NaN
            where one of them is constant.
        ks: Kolmogorov and Smirnov's distance of the two distributions, in [0, 1]: whether there are as many
            of each value, whichever controllers they are of.
        p: of that distance, if the distributions were the same.
    """

    name: str
    means: tuple[float, float]
    spearman: float
    ks: float
    p: float


@dataclass(frozen=True)
class Fate:
    """What becomes of the best controllers of the one simulation in the other.

    Attributes:
        count: how many they are.
        objective: their mean objective in the one and the other.
        success: the share of them that succeeds in the one and the other.
        kept: the share of them that are among as many best of the other.
    """

    count: int
    objective: tuple[float, float]
    success: tuple[float, float]
    kept: float


Column = Float[np.ndarray, " controllers"]


def agreement(name: str, one: Column, other: Column) -> Agreement:
    """Compare a measure of the same controllers in two simulations.

    Args:
        name: of the measure.
        one: its values, one per controller.
        other: its values there, in the same order.

    Returns:
        Means, rank correlation and distance of the distributions.
    """
    varies = bool(np.ptp(one) > 0 and np.ptp(other) > 0)
    distance = ks_2samp(one, other)
    return Agreement(
        name=name,
        means=(float(one.mean()), float(other.mean())),
        spearman=float(spearmanr(one, other).statistic) if varies else float("nan"),
        ks=float(distance.statistic),
        p=float(distance.pvalue),
    )


def fate(one: Column, other: Column, success: tuple[float, float]) -> Fate:
    """Follow the best controllers of one simulation into the other.

    Args:
        one: their objectives.
        other: their objectives there, in the same order.
        success: f above this is a success, in the one and the other.

    Returns:
        What becomes of the best `BEST`, or of the better half of fewer than twice as many.
    """
    count = max(1, min(BEST, len(one) // 2))
    best, best_there = (np.argsort(-values, kind="stable")[:count] for values in (one, other))
    return Fate(
        count=count,
        objective=(float(one[best].mean()), float(other[best].mean())),
        success=(float((one[best] > success[0]).mean()), float((other[best] > success[1]).mean())),
        kept=len(np.intersect1d(best, best_there)) / count,
    )


def worst(one: Column, other: Column, count: int) -> list[int]:
    """Find the controllers whose objectives differ most, in units of how much they vary.

    Args:
        one: objectives.
        other: objectives there, in the same order.
        count: how many are wanted.

    Returns:
        Their places, the worst first.
    """
    scale = max(float(one.std()), float(other.std()), 1e-12)
    return np.argsort(-np.abs(one - other) / scale, kind="stable")[:count].tolist()


def summary_text(
    measures: Sequence[Agreement], best: Fate, names: tuple[str, str], success: Mapping[str, float]
) -> str:
    """Say in a few lines of text how far two simulations agree.

    Args:
        measures: each in both.
        best: what becomes of the best of the one.
        names: of the one and the other.
        success: share of all controllers that succeed, by those names.

    Returns:
        A table, and two sentences.
    """
    wide = max(len(each.name) for each in measures)
    lines = [f"{'':{wide}}  {names[0]:>16}  {names[1]:>16}  Spearman  KS (p)"]
    lines += [
        f"{each.name:{wide}}  {each.means[0]:16.3f}  {each.means[1]:16.3f}  {each.spearman:8.2f}  "
        f"{each.ks:.2f} ({each.p:.2g})"
        for each in measures
    ]
    shares = " and ".join(f"{success[name]:.1%} in {name}" for name in names)
    lines.append(f"successes: {shares}")
    lines.append(
        f"the best {best.count} of {names[0]}: mean objective {best.objective[0]:+.3f} there, "
        f"{best.objective[1]:+.3f} in {names[1]}; {best.success[0]:.0%} and {best.success[1]:.0%} succeed; "
        f"{best.kept:.0%} are among the best {best.count} of {names[1]}"
    )
    return "\n".join(lines)
