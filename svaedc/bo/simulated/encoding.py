"""Latent paths of simulated episodes: means of q(tau|xi, y), where a trained model gives them."""

import numpy as np
import torch
from jaxtyping import Float32, Float64

from svaedc.model.svae_dc import SvaeDc

_TOGETHER = 256


def latent_paths(
    model: SvaeDc,
    xi: Float32[np.ndarray, "n obs time"],
    bad: Float32[np.ndarray, "n time"],
    y: Float32[np.ndarray, " n"],
) -> Float64[np.ndarray, "n k"]:
    r"""Encode episodes.

    Args:
        model: In evaluation mode.
        xi: Trajectories in SI units, at the stride of the model's training, [n, obs, time].
        bad: 1 at each bad step, or its degree, [n, time].
        y: Badness of each episode, [n].

    Returns:
        E[\tau] under q, flattened, [n, k].

    Raises:
        ValueError: The trajectories do not have the model's size.
    """
    expected = (model.config.observation_dim, model.config.time_steps)
    if xi.shape[1:] != expected:
        raise ValueError(f"this model takes xi [obs, time] {expected}, got {xi.shape[1:]}")
    found = []
    with torch.no_grad():
        for start in range(0, len(xi), _TOGETHER):
            rows = slice(start, start + _TOGETHER)
            episodes = (torch.tensor(part[rows]) for part in (xi, bad, y))
            found.append(model.split(model.posterior(*episodes).loc)[0])
    return torch.cat(found).double().numpy()
