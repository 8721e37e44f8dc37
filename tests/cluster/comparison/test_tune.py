"""What is said of a comparison while it runs."""

from cluster.comparison.records import RunKey
from cluster.comparison.tune import BestSoFar


def test_the_standing_shows_every_method_in_the_order_asked_for():
    standing = BestSoFar(("se", "random"), {RunKey("random", 0): 0.25, RunKey("random", 1): 0.75})
    assert str(standing) == "random 0.50"
    standing.best[RunKey("se", 0)] = 0.125
    assert str(standing) == "se 0.12, random 0.50"
    standing.best[RunKey("se", 1)] = float("nan")
    assert str(standing) == "se 0.12, random 0.50"
