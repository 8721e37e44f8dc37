"""A solid cylinder that stands on the ground and may be pushed over."""

from workers.simulation.bullet import pybullet
from workers.simulation.world import World

_MARGIN = 1e-3  # m; Bullet keeps this gap, so a body set down without it jumps


def moments(mass: float, radius: float, height: float) -> tuple[float, float, float]:
    """Principal moments of inertia of a solid cylinder about its centre.

    Args:
        mass: in kg.
        radius: in m.
        height: in m, along z.

    Returns:
        About x, y and z, in kg·m².
    """
    across = mass * (3 * radius**2 + height**2) / 12
    return across, across, mass * radius**2 / 2


class Cylinder:
    """A free cylinder, upright at its start pose after `reset`.

    Args:
        world: where it stands.
        radius: in m.
        height: in m.
        position: (x, y) of its axis at reset, in m.
    """

    def __init__(self, world: World, *, radius: float, height: float, position: tuple[float, float]) -> None:
        self._client = world.client
        self._radius = radius
        self._height = height
        self._start = (*position, height / 2 + _MARGIN)
        shape = pybullet.createCollisionShape(
            pybullet.GEOM_CYLINDER, radius=radius, height=height, physicsClientId=self._client
        )
        self.body: int = pybullet.createMultiBody(1.0, shape, -1, self._start, physicsClientId=self._client)

    def set_dynamics(
        self, *, mass: float, friction: float, rolling_friction: float, restitution: float
    ) -> None:
        """Set mass and contact coefficients; the inertia is that of a solid cylinder.

        Bullet's own inertia of a cylinder is that of its bounding box.

        Args:
            mass: kg.
            friction: coefficient of sliding.
            rolling_friction: coefficient of rolling.
            restitution: share of the speed kept in a bounce.
        """
        pybullet.changeDynamics(
            self.body,
            -1,
            mass=mass,
            localInertiaDiagonal=moments(mass, self._radius, self._height),
            lateralFriction=friction,
            rollingFriction=rolling_friction,
            restitution=restitution,
            physicsClientId=self._client,
        )

    def reset(self) -> None:
        """Stand the cylinder at its start, at rest."""
        pybullet.resetBasePositionAndOrientation(
            self.body, self._start, (0.0, 0.0, 0.0, 1.0), physicsClientId=self._client
        )
        pybullet.resetBaseVelocity(self.body, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), physicsClientId=self._client)

    def pose(self) -> tuple[tuple[float, float, float], tuple[float, float, float, float]]:
        """Position in m and orientation as a quaternion (x, y, z, w)."""
        return pybullet.getBasePositionAndOrientation(self.body, self._client)
