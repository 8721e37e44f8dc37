"""What is told of two simulations of the same controllers."""

import numpy as np
import pytest

from svaedc.analysis.agreement import Simulated, agreement, best_places, measure, summary_text, worst_places

RNG = np.random.default_rng(0)
F = RNG.normal(size=60)


def simulated(f=F, name="mine", success=0.0, **bad) -> Simulated:
    return Simulated(name, success, f, np.linspace(0.0, 1.0, len(f)), bad)


def test_a_simulation_agrees_with_itself():
    found = measure("objective", F, F)
    assert found.spearman == pytest.approx(1.0)
    assert (found.ks, found.p) == (0.0, 1.0)
    assert found.means == (F.mean(), F.mean())


def test_the_order_and_the_distribution_are_told_apart():
    """A shuffled simulation has all values and another order; a scaled one the order and other values."""
    shuffled, scaled = measure("f", F, RNG.permutation(F)), measure("f", F, 10 * F + 5)
    assert abs(shuffled.spearman) < 0.3
    assert shuffled.ks == 0.0
    assert scaled.spearman == pytest.approx(1.0)
    assert scaled.ks > 0.5
    assert scaled.p < 1e-6


def test_a_constant_measure_has_no_order():
    found = measure("tilt", np.zeros(20), np.arange(20.0))
    assert np.isnan(found.spearman)
    assert found.means == (0.0, 9.5)


def test_conditions_that_only_one_has_are_left_out():
    found = agreement(simulated(tilt=F, fall=F), simulated(fall=F, slip=F))
    assert [each.name for each in found.measures] == ["objective", "badness", "fall"]


def test_each_side_succeeds_by_its_own_threshold():
    found = agreement(simulated(success=0.0), simulated(success=9.0))
    assert found.success == (float((F > 0.0).mean()), 0.0)
    assert found.best.success == (1.0, 0.0)


def test_the_best_are_followed_into_the_other_simulation():
    best = agreement(simulated(), simulated(-F)).best
    assert best.count == 20
    assert best.objective[0] == pytest.approx(-best.objective[1])
    assert best.success == (1.0, 0.0)
    assert best.kept == 0.0
    assert agreement(simulated(), simulated()).best.kept == 1.0


@pytest.mark.parametrize(("controllers", "count"), [(1, 1), (5, 2), (39, 19), (60, 20)])
def test_the_best_are_never_more_than_half(controllers, count):
    places = best_places(F[:controllers])
    assert len(places) == count
    assert places[0] == np.argmax(F[:controllers])


def test_the_worst_disagreements_come_first():
    other = F.copy()
    other[[7, 3]] += [5.0, -9.0]
    assert worst_places(F, other, 2).tolist() == [3, 7]


def test_the_text_has_each_measure_and_both_names():
    none = np.zeros(60)
    text = summary_text(agreement(simulated(tilt=none), simulated(name="yours", success=9.0, tilt=none)))
    header, objective, _, tilt, successes, best = text.splitlines()
    assert header.split() == ["mine", "yours", "Spearman", "KS", "(p)"]
    assert objective.split()[0] == "objective"
    assert "1.00" in objective
    assert "nan" in tilt
    assert successes == f"successes: {(F > 0).mean():.1%} in mine and 0.0% in yours"
    assert best.startswith("the best 20 of mine: mean objective +")
    assert best.endswith("100% are among the best 20 of yours")
