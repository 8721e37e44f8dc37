"""The same formulas on arrays of NumPy and of torch: the one plans a trial, through the other gradients flow.

Nothing here imports torch; whoever passes a tensor has.
"""

import sys
from typing import Any

import numpy as np


def namespace(x: Any) -> Any:
    """The module whose functions take this array: `numpy`, or `torch` for a tensor."""
    return np if isinstance(x, np.ndarray) else sys.modules[type(x).__module__.partition(".")[0]]


def constant(values: Any, x: Any) -> Any:
    """Make an array of the kind of another one.

    Args:
        values: numbers, nested as NumPy takes them.
        x: array whose kind, type and device it shall have.

    Returns:
        The numbers.
    """
    return namespace(x).asarray(np.asarray(values), dtype=x.dtype, device=x.device)
