"""A quadratic over the unit cube, evaluated at once (appendix C): `quadratic-30d` and its sparse twin."""

from functools import partial

from workers.controllers.constant import Constant
from workers.environments.point import Point, coordinates
from workers.physics import PhysicsRanges
from workers.setups.setup import Setup
from workers.tasks.quadratic import Quadratic

HORIZON = 2  # steps: f is that of the last, and Gymnasium wants more than one
SUCCESS = 0.95  # of the way from the least to the greatest f; the paper names no threshold


def quadratic_30d() -> Setup:
    """f(x) = Σ_i (x_i + 1)² over [0,1]^30, in [30, 120] (appendix C of the paper)."""
    return _quadratic(name="quadratic-30d", dimensions=30, intrinsic=30)


def quadratic_30d_intrinsic_3() -> Setup:
    """f(x) = Σ_{i ≤ 3} (x_i + 1)² + 0.001 Σ_{i > 3} x_i over [0,1]^30, in [3, 12.027] (appendix C)."""
    return _quadratic(name="quadratic-30d-intrinsic-3", dimensions=30, intrinsic=3)


def _quadratic(*, name: str, dimensions: int, intrinsic: int) -> Setup:
    """A quadratic of so many dimensions, of which so many matter; no physics, and gaps without any."""
    task = Quadratic(dimensions, intrinsic)
    low, high = task.objective_limits
    return Setup(
        name=name,
        build=partial(Point, dimensions),
        controller=Constant(coordinates(dimensions)),
        task=task,
        observation=coordinates(dimensions),
        horizon=HORIZON,
        control_step=Point.control_step,
        physics=PhysicsRanges({}),
        gaps=dict.fromkeys(("paper", "training", "wide"), PhysicsRanges({})),
        objective_limits=task.objective_limits,
        success=low + SUCCESS * (high - low),
    )
