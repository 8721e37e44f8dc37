"""Scaling of trajectories, and the training statistics that the decoder starts from."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, final

import numpy as np
import torch
from jaxtyping import Float, Float32
from torch import Tensor, nn

SPREAD_FLOOR: Final = 1e-4
"""No dimension's spread is less, in parts of its range: one that never moves must not divide by zero."""


@dataclass(frozen=True)
class TrainingStatistics:
    """What a dataset's trajectories look like, measured on training episodes only.

    Attributes:
        low: Lower bound of each observation, SI units.
        high: Upper bound of each observation, SI units.
        median: Per-step median of the scaled trajectories.
        spread: Mean absolute residual s_d of each dimension around the median, scaled units.
        directions: Principal directions of the residuals in units of s_d, each times the standard deviation
            of its coefficient, strongest first.
    """

    low: Float32[np.ndarray, " obs"]
    high: Float32[np.ndarray, " obs"]
    median: Float32[np.ndarray, "obs time"]
    spread: Float32[np.ndarray, " obs"]
    directions: Float32[np.ndarray, "rank obs time"]


def measure(
    xi: Float32[np.ndarray, "episodes obs time"],
    bounds: tuple[Sequence[float], Sequence[float]],
    rank: int,
    rng: np.random.Generator,
) -> TrainingStatistics:
    """Statistics of trajectories that fit into memory a few times over.

    Args:
        xi: Training trajectories in SI units.
        bounds: Fixed lower and upper bounds of each observation, which become 0 and 1.
        rank: Principal directions to return; with fewer episodes the last ones are zero.
        rng: Starts the search for directions.

    Returns:
        Bounds, median, spread and directions.

    Raises:
        ValueError: No trajectories, bounds that do not fit, or trajectories that are not finite.
    """
    low, high = (np.asarray(bound, np.float32) for bound in bounds)
    if low.shape != xi.shape[1:2] or high.shape != low.shape or not (low < high).all():
        raise ValueError(f"bounds must be low < high for {xi.shape[1]} observations, got {low} and {high}")
    if len(xi) == 0:
        raise ValueError("statistics need at least one training trajectory, got none; collect episodes first")
    scaled = (xi - low[:, None]) / (high - low)[:, None]
    if not np.isfinite(scaled).all():
        raise ValueError("trajectories must be finite, got NaN or infinity; leave diverged episodes out")
    median = np.median(scaled, axis=0)
    residuals = scaled - median
    spread = np.maximum(np.abs(residuals).mean(axis=(0, 2)), SPREAD_FLOOR)
    directions = _principal_directions((residuals / spread[:, None]).reshape(len(xi), -1), rank, rng)
    return TrainingStatistics(low, high, median, spread, directions.reshape(rank, *median.shape))


def _principal_directions(
    rows: Float32[np.ndarray, "rows features"], rank: int, rng: np.random.Generator
) -> Float32[np.ndarray, "rank features"]:
    """Leading principal directions by randomised subspace iteration, scaled to unit-variance coefficients."""
    directions = np.zeros((rank, rows.shape[1]), np.float32)
    # Not torch.svd_lowrank: with niter=2 it misses 1.6 times the variance, with 3 it takes 1.3 times as long.
    subspace = rng.standard_normal((rows.shape[1], min(rank + 10, *rows.shape)), dtype=np.float32)
    for _ in range(3):
        subspace, _ = np.linalg.qr(rows.T @ (rows @ subspace))
    _, singular, right = np.linalg.svd(rows @ subspace, full_matrices=False)
    found = min(rank, len(singular))
    directions[:found] = (singular[:found, None] / np.sqrt(len(rows))) * (right[:found] @ subspace.T)
    return directions


@final
class Normalizer(nn.Module):
    """Trajectories in SI units to [0, 1] and back, and the median that errors are measured against.

    All are buffers, so a checkpoint explains itself.
    """

    low: Tensor
    high: Tensor
    median: Tensor
    spread: Tensor

    def __init__(self, observation_dim: int, time_steps: int) -> None:
        """Start as the identity on [0, 1]; `adopt` sets measured statistics."""
        super().__init__()
        self.register_buffer("low", torch.zeros(observation_dim, 1))
        self.register_buffer("high", torch.ones(observation_dim, 1))
        self.register_buffer("median", torch.full((observation_dim, time_steps), 0.5))
        self.register_buffer("spread", torch.full((observation_dim, 1), 0.25))

    def adopt(self, statistics: TrainingStatistics) -> None:
        """Copy measured statistics into the buffers."""
        self.low.copy_(torch.from_numpy(statistics.low).unsqueeze(1))
        self.high.copy_(torch.from_numpy(statistics.high).unsqueeze(1))
        self.median.copy_(torch.from_numpy(statistics.median))
        self.spread.copy_(torch.from_numpy(statistics.spread).unsqueeze(1))

    def normalize(self, xi: Float[Tensor, "batch obs time"]) -> Float[Tensor, "batch obs time"]:
        """SI units to parts of the observation range."""
        return (xi - self.low) / (self.high - self.low)

    def residual(self, xi: Float[Tensor, "batch obs time"]) -> Float[Tensor, "batch obs time"]:
        """SI units to deviations from the per-step median, in units of each dimension's spread."""
        return (self.normalize(xi) - self.median) / self.spread

    def denormalize(self, xi: Float[Tensor, "batch obs time"]) -> Float[Tensor, "batch obs time"]:
        """Parts of the observation range to SI units."""
        return xi * (self.high - self.low) + self.low


POSTERIOR_INPUTS: Final = {"scaled": Normalizer.normalize, "residual": Normalizer.residual}
"""q sees a trajectory in one of these forms; residuals cut the held-out reconstruction error by a fifth."""
