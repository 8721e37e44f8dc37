"""What is told of two simulations of the same controllers."""

import numpy as np
import pytest

from svaedc.analysis.agreement import agreement, fate, summary_text, worst

RNG = np.random.default_rng(0)
F = RNG.normal(size=60)


def test_a_simulation_agrees_with_itself():
    found = agreement("objective", F, F)
    assert found.spearman == pytest.approx(1.0)
    assert (found.ks, found.p) == (0.0, 1.0)
    assert found.means == (F.mean(), F.mean())


def test_the_order_and_the_distribution_are_told_apart():
    """A shuffled simulation has all values and another order; a scaled one the order and other values."""
    shuffled, scaled = agreement("f", F, RNG.permutation(F)), agreement("f", F, 10 * F + 5)
    assert abs(shuffled.spearman) < 0.3
    assert shuffled.ks == 0.0
    assert scaled.spearman == pytest.approx(1.0)
    assert scaled.ks > 0.5
    assert scaled.p < 1e-6


def test_a_constant_measure_has_no_order():
    found = agreement("tilt", np.zeros(20), np.arange(20.0))
    assert np.isnan(found.spearman)
    assert found.means == (0.0, 9.5)


def test_the_best_are_followed_into_the_other_simulation():
    found = fate(F, -F, (0.0, 0.0))
    assert found.count == 20
    assert found.objective[0] == pytest.approx(-found.objective[1])
    assert found.success == (1.0, 0.0)
    assert found.kept == 0.0
    assert fate(F, F, (0.0, 9.0)).success == (1.0, 0.0)
    assert fate(F, F, (0.0, 0.0)).kept == 1.0


@pytest.mark.parametrize(("controllers", "count"), [(1, 1), (5, 2), (39, 19), (60, 20)])
def test_the_best_are_never_more_than_half(controllers, count):
    assert fate(F[:controllers], F[:controllers], (0.0, 0.0)).count == count


def test_the_worst_disagreements_come_first():
    other = F.copy()
    other[[7, 3]] += [5.0, -9.0]
    assert worst(F, other, 2) == [3, 7]


def test_the_text_has_each_measure_and_both_names():
    measures = [agreement("objective", F, F), agreement("tilt", np.zeros(60), np.zeros(60))]
    text = summary_text(measures, fate(F, F, (0.0, 0.0)), ("mine", "yours"), {"mine": 0.25, "yours": 0.5})
    header, objective, tilt, successes, best = text.splitlines()
    assert header.split() == ["mine", "yours", "Spearman", "KS", "(p)"]
    assert objective.split()[0] == "objective"
    assert "1.00" in objective
    assert "nan" in tilt
    assert successes == "successes: 25.0% in mine and 50.0% in yours"
    assert best.startswith("the best 20 of mine: mean objective +")
    assert best.endswith("100% are among the best 20 of yours")
