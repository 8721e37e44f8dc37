"""What simulation shows of candidates before any trial: each was rolled out in several worlds.

A world is one draw of the physics, in one engine; all candidates were rolled out in the same ones.
"""

from dataclasses import dataclass

import numpy as np
import torch
from jaxtyping import Float, Float32, Int
from torch import Tensor


def spread(values: Float[Tensor, "*n e"]) -> Float[Tensor, "*n"]:
    """Standard deviation over the worlds; 0 for a single one."""
    return values.std(dim=-1, correction=0)


class Lookup:
    """The rows of controllers that were simulated; there is no saying anything of others.

    Args:
        x: The controllers, [n, D]; of equal ones the first counts.
    """

    def __init__(self, x: Float32[np.ndarray, "n D"]) -> None:
        self._rows = {row.tobytes(): number for number, row in reversed(list(enumerate(x)))}

    def rows(self, x: Float[Tensor, "m D"]) -> Int[Tensor, " m"]:
        """The row of each of these controllers.

        Raises:
            ValueError: One was not simulated.
        """
        wanted = x.detach().numpy().astype(np.float32)
        try:
            return torch.tensor([self._rows[row.tobytes()] for row in wanted], dtype=torch.long)
        except KeyError:
            raise ValueError(
                "a controller that was not simulated has neither a simulated objective nor features: choose "
                "a method that searches the candidates only (`-acqf` searches between them)"
            ) from None


@dataclass(frozen=True, eq=False)
class SimulatedOutcomes:
    """How every candidate fared in every world; also of candidates that a pool leaves out.

    Attributes:
        f: Objectives.
        y: Badness, in [0, 1].
        lookup: Rows of the candidates.
    """

    f: Float[Tensor, "n e"]
    y: Float[Tensor, "n e"]
    lookup: Lookup

    def __post_init__(self) -> None:
        """Refuse what is no outcome of at least one world."""
        if self.f.shape != self.y.shape or not self.f.shape[1]:
            raise ValueError(
                f"f and y must be [n, e] of at least one world, got {[*self.f.shape]} and {[*self.y.shape]}"
            )
        if not torch.isfinite(self.f).all():
            raise ValueError("every simulated objective must be finite, got NaN or infinity")

    def objectives(self, x: Float[Tensor, "m D"]) -> Float[Tensor, "m e"]:
        """Objectives of these candidates, in every world."""
        return self.f[self.lookup.rows(x)]

    def badness(self, x: Float[Tensor, "m D"]) -> Float[Tensor, "m e"]:
        """Badness of these candidates, in every world."""
        return self.y[self.lookup.rows(x)]


@dataclass(frozen=True, eq=False)
class SimulatedLatents:
    """Latent paths and badness of simulated candidates, in the place of a model's `latent_means`.

    Attributes:
        tau: Means of q(tau|xi, y) over the worlds, flattened.
        y: Mean badness over the worlds.
        lookup: Rows of the candidates.
    """

    tau: Float[Tensor, "n k"]
    y: Float[Tensor, " n"]
    lookup: Lookup

    def __call__(self, x: Float[Tensor, "m D"]) -> tuple[Float[Tensor, "m k"], Float[Tensor, " m"]]:
        """The two of these controllers, which must be candidates."""
        rows = self.lookup.rows(x)
        return self.tau[rows], self.y[rows]
