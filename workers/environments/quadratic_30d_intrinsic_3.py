"""The setup `quadratic-30d-intrinsic-3`: of 30 dimensions, three matter."""

from workers.environments.quadratic import maximised
from workers.setups import Setup


def setup() -> Setup:
    """f(x) = Σ_{i ≤ 3} (x_i + 1)² + 0.001 Σ_{i > 3} x_i over [0,1]^30, in [3, 12.027] (appendix C)."""
    return maximised(name="quadratic-30d-intrinsic-3", dimensions=30, intrinsic=3)
