"""The setup `quadratic-30d`: all 30 dimensions matter."""

from workers.environments.quadratic import maximised
from workers.setups import Setup


def setup() -> Setup:
    """f(x) = Σ_i (x_i + 1)² over [0,1]^30, in [30, 120] (appendix C of the paper)."""
    return maximised(name="quadratic-30d", dimensions=30, intrinsic=30)
