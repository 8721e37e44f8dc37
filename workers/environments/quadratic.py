"""What the setups of appendix C have in common: a quadratic over the unit cube, evaluated at once."""

from functools import partial

from workers.controllers.constant import Constant
from workers.environments.point import Point, coordinates
from workers.physics import PhysicsRanges
from workers.setups import Setup
from workers.tasks.quadratic import Quadratic

HORIZON = 2  # steps: f is that of the last, and Gymnasium wants more than one
SUCCESS = 0.95  # of the way from the least to the greatest f; the paper names no threshold


def maximised(*, name: str, dimensions: int, intrinsic: int) -> Setup:
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
