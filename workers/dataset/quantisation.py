"""ξ as int16 codes between the fixed bounds of its channels: a third of the bytes, for a stated error."""

from typing import Any

import numpy as np
from jaxtyping import Float32, Float64, Int16

from workers.dataset.identity import Identity

CODES = 2**16
_FIRST = -(2**15)

Stored = Float32[np.ndarray, "*n obs time"] | Int16[np.ndarray, "*n obs time"]


def encode(xi: Float32[np.ndarray, "*n obs time"], identity: Identity) -> Stored:
    """Encode trajectories as the identity stores them.

    Args:
        xi: in the units of its channels, [..., obs, T].
        identity: of the dataset.

    Returns:
        Unchanged numbers, or int16 codes for the nearest of 2^16 values of each channel, [..., obs, T].

    Raises:
        ValueError: a value to be coded is not finite.
    """
    if identity.storage == "float32":
        return xi
    if not np.isfinite(xi).all():
        raise ValueError("ξ holds NaN or infinity, which int16 cannot store; use storage float32")
    low, high = _bounds(identity)
    place = np.rint((xi.astype(np.float64) - low) / (high - low) * (CODES - 1))
    return (np.clip(place, 0, CODES - 1) + _FIRST).astype(np.int16)


def decode(values: Stored, identity: Identity) -> Float32[np.ndarray, "*n obs time"]:
    """Restore trajectories from what is stored: low + (code + 32768) · (high − low) / 65535.

    Args:
        values: as from `encode`, [..., obs, T].
        identity: of the dataset.

    Returns:
        Trajectories in the units of their channels, [..., obs, T].
    """
    if identity.storage == "float32":
        return values
    low, high = _bounds(identity)
    return (low + (values.astype(np.float64) - _FIRST) * ((high - low) / (CODES - 1))).astype(np.float32)


def error_bound(identity: Identity) -> Float64[np.ndarray, " obs"]:
    """The largest difference between a value within its channel's bounds and what is restored of it.

    Half a step between codes, and the rounding to float32. A value beyond its bounds is restored as the
    bound; by more than 1e-5 none is, for that episode has diverged.
    """
    low, high = (bound[:, 0] for bound in _bounds(identity))
    if identity.storage == "float32":
        return np.zeros_like(low)
    magnitude = np.maximum(np.abs(low), np.abs(high)).astype(np.float32)
    return (high - low) / (CODES - 1) / 2 + np.spacing(magnitude).astype(np.float64) / 2


def describe_encoding(identity: Identity) -> dict[str, Any]:
    """What a stranger must know to read the codes; nothing for plain numbers."""
    if identity.storage == "float32":
        return {}
    return {"xi_value": "low + (code + 32768) * (high - low) / 65535, with the bounds of its channel"}


def _bounds(identity: Identity) -> tuple[Float64[np.ndarray, "obs 1"], Float64[np.ndarray, "obs 1"]]:
    low = np.array([[low] for _, _, low, _ in identity.observation], dtype=np.float64)
    high = np.array([[high] for _, _, _, high in identity.observation], dtype=np.float64)
    return low, high
