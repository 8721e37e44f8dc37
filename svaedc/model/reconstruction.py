"""What a model makes of an episode, and which held-out episodes are worth a look."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import torch
from jaxtyping import Float, Float32

from svaedc.data.episodes import Batch
from svaedc.model.svae_dc import SvaeDc

RANDOM: Final = 2
"""So many episodes are drawn at random beside the best and the worst."""


@dataclass(frozen=True, eq=False)
class Reconstruction:
    """One way to tell an episode.

    Attributes:
        name: `reconstructed` from the trajectory, or `generated` from x alone.
        xi: The trajectory, in SI units.
        y: The badness, in [0, 1]; NaN of an SVAE, which knows nothing of badness.
    """

    name: str
    xi: Float32[np.ndarray, "obs time"]
    y: float


def reconstructions(
    model: SvaeDc,
    x: Float32[np.ndarray, " controller"],
    xi: Float32[np.ndarray, "obs time"],
    bad: Float32[np.ndarray, " time"],
    y: float,
) -> tuple[Reconstruction, Reconstruction]:
    """An episode decoded from the mean of q(tau|xi, y), and from that of p(tau|x).

    Args:
        model: In evaluation mode.
        x: Controller in the unit cube.
        xi: Trajectory, SI units, at the model's training stride.
        bad: Whether each of its steps is bad, or the degree.
        y: Badness of the episode.

    Returns:
        The reconstructed episode, then the generated one.
    """
    one = Batch(*(torch.from_numpy(np.array(part, np.float32)[None]) for part in (x, xi, bad, y)))
    with torch.no_grad():
        codes = {
            "reconstructed": model.posterior(one.xi, one.bad, one.y).loc,
            "generated": model.prior(one.x).loc,
        }
        first, second = (_decode(model, name, *model.split(code)) for name, code in codes.items())
    return first, second


def _decode(model: SvaeDc, name: str, tau: torch.Tensor, psi: torch.Tensor) -> Reconstruction:
    y = float(model.badness_at(psi)) if model.config.has_psi else float("nan")
    return Reconstruction(name, model.normaliser.denormalize(model.p_xi(tau).loc)[0].numpy(), y)


def remarkable(f: Float[np.ndarray, " episodes"], rng: np.random.Generator) -> dict[str, int]:
    """Pick the episodes with the best and the worst objective, and others at random.

    Args:
        f: Objectives of held-out episodes, at least one.
        rng: Draws.

    Returns:
        Positions by name: `best`, `worst`, and up to `RANDOM` called `random 1` and so on.
    """
    chosen = {"best": int(np.argmax(f)), "worst": int(np.argmin(f))}
    others = np.setdiff1d(np.arange(len(f)), list(chosen.values()))
    drawn = rng.permutation(others)[:RANDOM].tolist()
    return chosen | {f"random {number}": position for number, position in enumerate(drawn, start=1)}
