"""Scaling and the statistics the decoder starts from, against numpy."""

import numpy as np
import pytest
import torch

from svaedc.model.normalizer import SPREAD_FLOOR, Normalizer, measure

RNG = np.random.default_rng(1)


def trajectories(count: int = 50) -> np.ndarray:
    return np.random.default_rng(0).standard_normal((count, 3, 30), dtype=np.float32)


def measured(xi: np.ndarray, rank: int = 10):
    return measure(xi, ([-4.0] * 3, [4.0] * 3), rank, np.random.default_rng(1))


def test_median_and_spread_are_those_of_the_scaled_trajectories():
    xi = trajectories()
    statistics = measured(xi)
    scaled = (xi + 4.0) / 8.0
    np.testing.assert_allclose(statistics.median, np.median(scaled, axis=0), atol=1e-6)
    residuals = np.abs(scaled - np.median(scaled, axis=0))
    np.testing.assert_allclose(statistics.spread, residuals.mean((0, 2)), rtol=1e-4)


def test_directions_are_the_leading_principal_ones():
    weights = np.random.default_rng(2).standard_normal((200, 4)) * [8.0, 4.0, 2.0, 1.0]
    shapes = np.linalg.qr(np.random.default_rng(3).standard_normal((90, 4)))[0].T
    xi = 0.1 * (weights @ shapes).reshape(200, 3, 30).astype(np.float32)
    statistics = measured(xi, rank=4)
    scaled = (xi + 4.0) / 8.0
    rows = ((scaled - statistics.median) / statistics.spread[:, None]).reshape(200, -1)
    _, singular, right = np.linalg.svd(rows, full_matrices=False)
    found = statistics.directions.reshape(4, -1)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), singular[:4] / np.sqrt(200), rtol=1e-3)
    overlap = np.abs(np.sum(found * right[:4], axis=1)) / np.linalg.norm(found, axis=1)
    np.testing.assert_allclose(overlap, 1.0, atol=1e-3)


def test_more_directions_than_episodes_are_zero():
    statistics = measured(trajectories(5), rank=12)
    assert statistics.directions.shape == (12, 3, 30)
    assert np.abs(statistics.directions[5:]).max() == 0.0


def test_a_dimension_that_never_moves_gets_the_least_spread():
    xi = trajectories()
    xi[:, 1] = 0.5
    assert measured(xi).spread[1] == np.float32(SPREAD_FLOOR)


@pytest.mark.parametrize(
    ("low", "high"), [([0.0] * 2, [1.0] * 2), ([0.0] * 3, [0.0] * 3), ([1.0] * 3, [0.0] * 3)]
)
def test_bounds_that_do_not_fit_are_refused(low, high):
    with pytest.raises(ValueError, match="low < high for 3 observations"):
        measure(trajectories(), (low, high), 4, RNG)


def test_trajectories_that_are_not_finite_are_refused():
    xi = trajectories()
    xi[3, 1, 7] = np.nan
    with pytest.raises(ValueError, match="leave diverged episodes out"):
        measured(xi)


def test_no_trajectories_are_refused():
    with pytest.raises(ValueError, match="at least one training trajectory"):
        measured(trajectories(0))


def test_scaling_puts_the_bounds_at_zero_and_one_and_back():
    normaliser = Normalizer(3, 30)
    normaliser.adopt(measured(trajectories()))
    xi = torch.stack([torch.full((3, 30), -4.0), torch.full((3, 30), 4.0)])
    scaled = normaliser.normalize(xi)
    torch.testing.assert_close(scaled, torch.stack([torch.zeros(3, 30), torch.ones(3, 30)]))
    torch.testing.assert_close(normaliser.denormalize(scaled), xi)
