"""The stable push: bad conditions and objective of hand-made trajectories."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from workers.environments.environment import Observed
from workers.tasks.stable_push import StablePush

TABLE_X, TABLE_Y = (0.0, 1.5), (-0.45, 0.45)
Y_MAX = 0.9
STEPS = 4


def _task(direction: float = -1.0) -> StablePush:
    return StablePush(
        starts=((0.32, 0.15), (0.50, 0.15)),
        direction=direction,
        table_x=TABLE_X,
        table_y=TABLE_Y,
        margin=0.05,
        channel=7,
    )


def _observed(
    first=(0.32, 0.15), second=(0.5, 0.15), *, turn=None, hand=(0.5, 0.0, 0.2), contact=False
) -> Observed:
    """Two objects and a hand that keep their places for a few steps; `turn` is the first object's."""
    xi = np.zeros((25, STEPS), dtype=np.float32)
    for number, (place, rotation) in enumerate(
        [(first, turn or Rotation.identity()), (second, Rotation.identity())]
    ):
        begin = 7 + 9 * number
        xi[begin : begin + 3] = np.array([*place, 0.11])[:, None]
        xi[begin + 3 : begin + 9] = rotation.as_matrix()[:, :2].T.reshape(6, 1)
    signals = {
        "hand_position": np.tile(np.array(hand)[:, None], STEPS),
        "table_contact": np.full(STEPS, contact),
    }
    return Observed(xi, signals)


def _objective(observed: Observed, direction: float = -1.0) -> float:
    task = _task(direction)
    return task.objective(observed, task.is_bad(observed))


def _bad(observed: Observed) -> list[bool]:
    rows = _task().is_bad(observed)
    assert rows.shape == (4, STEPS)
    assert np.all(rows == rows[:, :1])
    return rows[:, 0].tolist()


def test_untouched_objects_are_worth_nothing_and_not_bad():
    assert _objective(_observed()) == pytest.approx(0.0, abs=1e-6)
    assert _bad(_observed()) == [False] * 4


@given(st.floats(-0.44, 0.44))
def test_a_push_towards_minus_y_counts_positive(y):
    assert _objective(_observed(first=(0.32, y))) == pytest.approx(0.15 - y, abs=1e-6)


def test_the_other_direction_turns_the_sign():
    assert _objective(_observed(first=(0.32, -0.2)), direction=1.0) == pytest.approx(-0.35, abs=1e-6)


def test_both_objects_count():
    assert _objective(_observed(first=(0.3, -0.1), second=(0.5, -0.2))) == pytest.approx(0.6, abs=1e-6)


def test_a_tipped_object_costs_the_width_of_the_table():
    tipped = _observed(first=(0.32, -0.4), turn=Rotation.from_euler("x", 90, degrees=True))
    assert _objective(tipped) == pytest.approx(-Y_MAX)
    assert _bad(tipped) == [True, False, False, False]


def test_an_object_off_the_table_counts_as_tipped():
    fallen = _observed(first=(0.32, -0.46))
    assert _objective(fallen) == pytest.approx(-Y_MAX)
    assert _bad(fallen) == [False, True, False, False]


def test_an_object_that_ends_upright_counts_whatever_happened_before():
    observed = _observed(first=(0.32, 0.0))
    observed.xi[12, 0] = -1.0
    observed.xi[11, 0] = -1.0
    assert _objective(observed) == pytest.approx(0.15, abs=1e-6)


@given(st.integers(0, 100_000))
def test_tipped_means_an_axis_more_than_30_degrees_from_the_vertical(seed):
    rotation = Rotation.random(random_state=seed)
    lean = np.degrees(np.arccos(np.clip(rotation.apply([0, 0, 1])[2], -1, 1)))
    if abs(lean - 30) > 1e-2:
        assert _bad(_observed(turn=rotation))[0] == (lean > 30)


@pytest.mark.parametrize(("lean", "tipped"), [(29.9, False), (30.1, True), (180.0, True)])
def test_the_limit_is_30_degrees_in_every_direction_and_spin(lean, tipped):
    for heading in range(0, 360, 45):
        for spin in (0, 77):
            turn = Rotation.from_euler("zyz", [spin, lean, heading], degrees=True)
            assert _bad(_observed(turn=turn))[0] == tipped


@pytest.mark.parametrize(
    ("hand", "outside"),
    [
        ((-0.04, 0.0, 0.2), False),
        ((-0.06, 0.0, 0.2), True),
        ((1.54, 0.0, 0.2), False),
        ((1.56, 0.0, 0.2), True),
        ((0.5, 0.49, 0.2), False),
        ((0.5, 0.51, 0.2), True),
        ((0.5, -0.51, 0.2), True),
    ],
)
def test_the_hand_may_leave_the_table_by_5_cm(hand, outside):
    assert _bad(_observed(hand=hand)) == [False, False, outside, False]


def test_touching_the_table_is_bad():
    assert _bad(_observed(contact=True)) == [False, False, False, True]


def test_the_limits_of_the_objective_are_reached_by_the_worst_and_the_best():
    assert _task().objective_limits == pytest.approx((-1.8, 1.2))
    best = _objective(_observed(first=(0.3, -0.45), second=(0.5, -0.45)))
    worst = _objective(_observed(first=(0.3, -0.5), second=(0.5, -0.5)))
    assert (worst, best) == pytest.approx(_task().objective_limits, abs=1e-6)


def test_a_direction_that_is_neither_way_is_refused():
    with pytest.raises(ValueError, match="direction must be"):
        _task(direction=0.5)
