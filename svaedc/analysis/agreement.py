"""How far two simulations of the same controllers agree, and what becomes of the best of one in the other."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Int64
from scipy.stats import ks_2samp, spearmanr

BEST = 20
"""What becomes of so many of the best controllers is told."""

Column = Float[np.ndarray, " controllers"]


@dataclass(frozen=True, eq=False)
class Simulated:
    """What a simulation gave for some controllers.

    Attributes:
        name: of the simulation.
        success: f above this is a success.
        f: objectives.
        y: badness, in [0, 1].
        bad: the share of steps in which each bad condition held, or its mean degree, by its name.
    """

    name: str
    success: float
    f: Column
    y: Column
    bad: Mapping[str, Column]


@dataclass(frozen=True)
class Measure:
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


@dataclass(frozen=True)
class Agreement:
    """How far two simulations agree.

    Attributes:
        names: of the one and the other.
        measures: objective, badness, and each bad condition that both have.
        success: the share of all controllers that succeeds in the one and the other.
        best: what becomes of the best of the one.
    """

    names: tuple[str, str]
    measures: tuple[Measure, ...]
    success: tuple[float, float]
    best: Fate


def agreement(one: Simulated, other: Simulated) -> Agreement:
    """Compare two simulations.

    Args:
        one: what it gave.
        other: what it gave for the same controllers, in the same order.

    Returns:
        How far they agree.
    """
    shared = [name for name in one.bad if name in other.bad]
    return Agreement(
        names=(one.name, other.name),
        measures=(
            measure("objective", one.f, other.f),
            measure("badness", one.y, other.y),
            *(measure(name, one.bad[name], other.bad[name]) for name in shared),
        ),
        success=(_success(one), _success(other)),
        best=_fate(one, other),
    )


def measure(name: str, one: Column, other: Column) -> Measure:
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
    return Measure(
        name=name,
        means=(float(one.mean()), float(other.mean())),
        spearman=float(spearmanr(one, other).statistic) if varies else float("nan"),
        ks=float(distance.statistic),
        p=float(distance.pvalue),
    )


def best_places(f: Column) -> Int64[np.ndarray, " best"]:
    """Find the best `BEST` controllers, or the better half of fewer than twice as many; the best first."""
    return np.argsort(-f, kind="stable")[: max(1, min(BEST, len(f) // 2))]


def worst_places(one: Column, other: Column, count: int) -> Int64[np.ndarray, " worst"]:
    """Find the controllers whose objectives differ most.

    Args:
        one: objectives.
        other: objectives there, in the same order.
        count: how many are wanted.

    Returns:
        Their places, the worst first.
    """
    return np.argsort(-np.abs(one - other), kind="stable")[:count]


def _fate(one: Simulated, other: Simulated) -> Fate:
    best, best_there = best_places(one.f), best_places(other.f)
    return Fate(
        count=len(best),
        objective=(float(one.f[best].mean()), float(other.f[best].mean())),
        success=(_success(one, best), _success(other, best)),
        kept=len(np.intersect1d(best, best_there)) / len(best),
    )


def _success(simulated: Simulated, places: Int64[np.ndarray, " chosen"] | slice = slice(None)) -> float:
    return float((simulated.f[places] > simulated.success).mean())


def summary_text(found: Agreement) -> str:
    """Say in a few lines of text how far two simulations agree: a table, and two sentences."""
    (one, other), best = found.names, found.best
    wide = max(len(each.name) for each in found.measures)
    lines = [f"{'':{wide}}  {one:>16}  {other:>16}  Spearman  KS (p)"]
    lines += [
        f"{each.name:{wide}}  {each.means[0]:16.3f}  {each.means[1]:16.3f}  {each.spearman:8.2f}  "
        f"{each.ks:.2f} ({each.p:.2g})"
        for each in found.measures
    ]
    lines.append(f"successes: {found.success[0]:.1%} in {one} and {found.success[1]:.1%} in {other}")
    lines.append(
        f"the best {best.count} of {one}: mean objective {best.objective[0]:+.3f} there, "
        f"{best.objective[1]:+.3f} in {other}; {best.success[0]:.0%} and {best.success[1]:.0%} succeed; "
        f"{best.kept:.0%} are among the best {best.count} of {other}"
    )
    return "\n".join(lines)
