import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jaxtyping import TypeCheckError

from svaedc.bo.history import History


def history(count=3, dimensions=2):
    rng = np.random.default_rng(0)
    return History(rng.random((count, dimensions)), rng.normal(size=count))


def test_history_keeps_its_own_read_only_copies():
    x, f = np.full((1, 2), 0.5), np.zeros(1)
    kept = History(x, f)
    x[:] = 0.9
    assert (kept.x == 0.5).all()
    with pytest.raises(ValueError, match="read-only"):
        kept.x[0, 0] = 0.1


def test_appending_leaves_the_earlier_history_as_it_was():
    before = history()
    after = before.append(np.array([0.1, 0.2]), 1.5)
    assert (len(before), len(after)) == (3, 4)
    np.testing.assert_array_equal(after.x[:3], before.x)
    np.testing.assert_array_equal(after.x[3], [0.1, 0.2])
    assert after.f[3] == 1.5


def test_trial_without_objective_is_tried_but_teaches_nothing():
    after = history().append(np.array([0.1, 0.2]), float("nan"))
    assert len(after) == 3
    np.testing.assert_array_equal(after.failed, [[0.1, 0.2]])
    np.testing.assert_array_equal(after.tried, np.concatenate([after.x, [[0.1, 0.2]]]))


@given(st.lists(st.floats(allow_infinity=False, width=32), max_size=12))
def test_every_trial_is_either_measured_or_failed(objectives):
    grown = History.empty(3)
    for index, f in enumerate(objectives):
        grown = grown.append(np.full(3, index / 12, dtype=np.float32), f)
    assert len(grown) == np.isfinite(objectives).sum()
    assert len(grown.tried) == len(objectives)


@pytest.mark.parametrize("outside", [-0.01, 1.01, np.nan])
def test_controller_outside_the_unit_cube_is_refused(outside):
    with pytest.raises(ValueError, match="unit cube"):
        history().append(np.array([0.5, outside]), 0.0)


def test_infinite_objective_is_refused_with_a_remedy():
    with pytest.raises(ValueError, match=r"finite, got inf.*failed"):
        history().append(np.array([0.5, 0.5]), float("inf"))


def test_shapes_that_do_not_belong_together_are_refused():
    with pytest.raises((ValueError, TypeCheckError), match=r"x must be \[n, D\] and f \[n\]|parameter 'f'"):
        History(np.zeros((3, 2)), np.zeros(2))
    with pytest.raises(ValueError, match="failed must be"):
        History(np.zeros((3, 2)), np.zeros(3), np.zeros((1, 3)))
