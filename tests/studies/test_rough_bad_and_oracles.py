"""The parts of the studies around the reproduction that can be wrong without anybody noticing."""

import numpy as np
import pytest
import torch

from studies.oracle import gain, looked_up
from studies.sensitivity import ROUGH, SAME, Cell, cells_of, flipped, late
from svaedc.data.episodes import Episodes

RNG = np.random.default_rng(7)


def episodes() -> Episodes:
    bad = (RNG.random((400, 50)) < 0.2).astype(np.float32)
    x = RNG.random((400, 3), dtype=np.float32)
    return Episodes(x, np.zeros((400, 2, 50), np.float32), bad, bad.mean(axis=1), np.arange(400))


def test_flipping_all_steps_inverts_badness_and_flipping_some_moves_it_by_their_share():
    before = episodes()
    np.testing.assert_array_equal(flipped(1.0, before).bad, 1 - before.bad)
    np.testing.assert_allclose(flipped(1.0, before).y, 1 - before.y, atol=1e-6)
    # y (1 - s) + (1 - y) s
    expected = before.y.mean() * 0.7 + (1 - before.y.mean()) * 0.3
    assert flipped(0.3, before).y.mean() == pytest.approx(expected, abs=0.01)


def test_a_late_g_bad_says_of_every_step_what_held_before_and_nothing_at_first():
    before, after = episodes(), late(0.1, episodes())
    assert after.bad.shape == before.bad.shape
    assert not after.bad[:, :5].any()
    lagged = late(0.1, before)
    np.testing.assert_array_equal(lagged.bad[:, 5:], before.bad[:, :-5])
    np.testing.assert_allclose(lagged.y, lagged.bad.mean(axis=1))


def test_each_cell_differs_from_the_base_in_one_thing_and_shares_its_model_where_it_can():
    base = Cell("f", 800, 1.0, SAME, 10, "paper", 5000, 3)
    cells = cells_of(base, 800)
    changed = {
        label: [name for name, value in vars(cell).items() if value != getattr(base, name)]
        for label, cell in cells.items()
    }
    assert changed.pop("none") == []
    assert all(len(names) == 1 for names in changed.values())
    assert {names[0] for names in changed.values()} == {"count", "kl", "bad", "gap", "pool"}
    assert {cell.bad for cell in cells.values()} == set(ROUGH)
    own = {label for label, cell in cells.items() if cell.model != base.model}
    assert own == {label for label, names in changed.items() if names[0] in {"count", "kl", "bad"}}


def test_the_looked_up_model_answers_any_subset_in_any_order():
    x = RNG.random((6, 3), dtype=np.float32)
    tau, y = torch.arange(12.0).reshape(6, 2), torch.linspace(0, 1, 6)
    found = looked_up(x, tau, y)(torch.from_numpy(x[[4, 0, 2]]))
    assert torch.equal(found[0], tau[[4, 0, 2]])
    assert torch.equal(found[1], y[[4, 0, 2]])
    with pytest.raises(KeyError):
        looked_up(x, tau, y)(torch.zeros(1, 3))


def test_a_gain_is_paired_by_run():
    theirs = [-0.9, -0.3, 0.3, 0.9]
    found = gain({"best 10": [each + 0.05 for each in theirs]}, {"best 10": theirs}, 10)
    assert (found.mean, found.low, found.high) == pytest.approx((0.05, 0.05, 0.05))
