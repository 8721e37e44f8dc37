"""Rows of a training cache as the model sees them, gathered in batches from arrays or memory maps."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, NamedTuple

import numpy as np
import torch
from jaxtyping import Float, Float32, Integer
from torch import Tensor

_MEASURED_TOGETHER: Final = 256


class Batch(NamedTuple):
    """A few episodes as tensors; `xi` is channel-major and in SI units."""

    x: Float[Tensor, "batch controller"]
    xi: Float[Tensor, "batch obs time"]
    bad: Float[Tensor, "batch time"]
    y: Float[Tensor, " batch"]


@dataclass(frozen=True)
class Episodes:
    """Selected rows of equally long arrays; nothing is copied until a batch is gathered.

    Attributes:
        x: Controllers in the unit cube.
        xi: Trajectories, channel-major, SI units, at the training stride.
        bad: 1 where any bad condition fired at a sampled step, else 0.
        y: Badness over all steps, in [0, 1].
        rows: Rows of the arrays that belong to this selection.
    """

    x: Float32[np.ndarray, "_ controller"]
    xi: Float32[np.ndarray, "_ obs time"]
    bad: Float32[np.ndarray, "_ time"]
    y: Float32[np.ndarray, " _"]
    rows: Integer[np.ndarray, " episodes"]

    def __post_init__(self) -> None:
        """Refuse arrays of different lengths and rows outside them."""
        lengths = {name: len(getattr(self, name)) for name in ("x", "xi", "bad", "y")}
        if len(set(lengths.values())) != 1:
            raise ValueError(
                f"the arrays of one cache must be equally long, got {lengths}; rebuild the cache"
            )
        if len(self.rows) and not 0 <= self.rows.min() <= self.rows.max() < len(self.x):
            raise ValueError(
                f"rows must lie in 0..{len(self.x) - 1}, got {self.rows.min()}..{self.rows.max()}"
            )

    def __len__(self) -> int:
        """Episodes in the selection."""
        return len(self.rows)

    def require_sizes(self, controller_dim: int, observation_dim: int, time_steps: int) -> None:
        """Raise ValueError unless the arrays have these sizes.

        Args:
            controller_dim: D of x.
            observation_dim: Channels of xi.
            time_steps: Steps of xi at the training stride.
        """
        expected = ((controller_dim,), (observation_dim, time_steps))
        found = (self.x.shape[1:], self.xi.shape[1:])
        if found != expected:
            raise ValueError(
                f"this model takes x {expected[0]} and xi [obs, time] {expected[1]}, "
                f"got {found[0]} and {found[1]}; check the setup and the training stride"
            )

    def gather(self, positions: Integer[np.ndarray, " batch"], device: torch.device) -> Batch:
        """Read episodes in storage order, whatever the order of `positions`: a memory map is read forwards.

        Args:
            positions: In the selection, from 0, [batch].
            device: Where the tensors go.

        Returns:
            The episodes, sorted by position.
        """
        rows = self.rows[np.sort(positions)]
        columns = (torch.from_numpy(np.asarray(array[rows])) for array in (self.x, self.xi, self.bad, self.y))
        return Batch(*(column.to(device) for column in columns))

    def sample(self, count: int, rng: np.random.Generator) -> "Episodes":
        """Draw episodes without replacement.

        Args:
            count: At most so many.
            rng: Draws them.

        Returns:
            A selection of the same arrays, in storage order.
        """
        return replace(self, rows=self.rows[np.sort(rng.permutation(len(self))[:count])])


def measure_batches(
    episodes: Episodes, device: torch.device, measure: Callable[[Batch], dict[str, Tensor]]
) -> dict[str, Tensor]:
    """What `measure` says of each episode, batch after batch, without gradients.

    The results are allocated as a whole beforehand: small tensors kept from each batch would sit between the
    large ones that are freed, and memory would grow with the number of episodes.

    Args:
        episodes: At least one.
        device: Where batches and results are.
        measure: Tensors with one row per episode of a batch, by name.

    Returns:
        Tensors with one row per episode, by name.
    """
    results: dict[str, Tensor] = {}
    with torch.no_grad():
        for start in range(0, len(episodes), _MEASURED_TOGETHER):
            positions = np.arange(start, min(start + _MEASURED_TOGETHER, len(episodes)))
            found = measure(episodes.gather(positions, device))
            if not results:
                results = {
                    name: part.new_empty(len(episodes), *part.shape[1:]) for name, part in found.items()
                }
            for name, part in found.items():
                results[name][start : start + len(positions)] = part
    return results


def split(episodes: Episodes, held_out: Integer[np.ndarray, " held_out"]) -> tuple[Episodes, Episodes]:
    """Training and held-out episodes.

    Args:
        episodes: The selection to split.
        held_out: Those of its rows that are held out; the cache knows them (`TrainingCache.held_out`).

    Returns:
        The rest for training, and the held-out ones, both selections of the same arrays.

    Raises:
        ValueError: A row is not in the selection.
    """
    strange = np.setdiff1d(held_out, episodes.rows)
    if len(strange):
        raise ValueError(
            f"held-out rows must be rows of the selection, got {strange[0]}; take them from the same cache"
        )
    is_held_out = np.isin(episodes.rows, held_out)
    return (
        replace(episodes, rows=episodes.rows[~is_held_out]),
        replace(episodes, rows=episodes.rows[is_held_out]),
    )
