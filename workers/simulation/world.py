"""One Bullet world: gravity, a ground plane, and a reset that forgets every contact."""

import math
from collections.abc import Iterable, Iterator

from workers.simulation.bullet import pybullet
from workers.simulation.server import Server

GRAVITY = -9.81  # m/s²
_STATIC = (2, -3)  # Bullet's own collision group and mask of fixed bases
_DYNAMIC = (1, -1)  # and of everything else
_GROUND_ONLY = (1, 2)
_NOTHING = (0, 0)


class World(Server):
    """A physics server of this process, with a ground plane at z = 0.

    Contacts take the product of the two bodies' friction and restitution; the plane has 1.0 of both, so that
    a contact with the ground has the values of the body that touches it.

    Args:
        time_step: seconds of one `step`.
        solver_iterations: constraint solver iterations of one step.
    """

    def __init__(self, *, time_step: float, solver_iterations: int) -> None:
        super().__init__()
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=time_step,
            numSolverIterations=solver_iterations,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            physicsClientId=self.client,
        )
        pybullet.setGravity(0.0, 0.0, GRAVITY, physicsClientId=self.client)
        shape = pybullet.createCollisionShape(pybullet.GEOM_PLANE, physicsClientId=self.client)
        self.plane: int = pybullet.createMultiBody(0.0, shape, physicsClientId=self.client)
        pybullet.changeDynamics(
            self.plane, -1, lateralFriction=1.0, restitution=1.0, physicsClientId=self.client
        )
        self._intangible: set[tuple[int, int]] = set()
        self._ground_only: set[int] = set()
        self._filters: dict[tuple[int, int], tuple[int, int]] = {}

    def step(self) -> None:
        """Advance by one time step."""
        pybullet.stepSimulation(self.client)

    def make_intangible(self, body: int, links: Iterable[int]) -> None:
        """Let links touch nothing from the next `forget_contacts` on, like fingers kept shut.

        Args:
            body: to which they belong.
            links: their indices; −1 is the base.
        """
        self._intangible.update((body, link) for link in links)

    def touch_ground_only(self, body: int) -> None:
        """Let the links of a body touch fixed bodies and nothing else, from the next `forget_contacts` on.

        Bullet lets the links of one body pass through each other anyway, but first finds out which are near.

        Args:
            body: with all its links.
        """
        self._ground_only.add(body)

    def forget_contacts(self) -> None:
        """Destroy every contact pair, so that the next episode starts like the first of a fresh world.

        Resetting poses keeps contact manifolds and the order of pairs alive, and with them impulses of the
        episode before (a Bullet property, measured: 7 of 32 episodes differ). Switching every link's
        collisions off, detecting, and on again removes all pairs. Load every body before the first call.
        """
        if not self._filters:
            self._filters = dict(self._default_filters())
        for body, link in self._filters:
            self._filter(body, link, _NOTHING)
        pybullet.performCollisionDetection(physicsClientId=self.client)
        for (body, link), group_and_mask in self._filters.items():
            if (body, link) not in self._intangible:
                self._filter(body, link, group_and_mask)

    def _default_filters(self) -> Iterator[tuple[tuple[int, int], tuple[int, int]]]:
        for body in range(pybullet.getNumBodies(physicsClientId=self.client)):  # ids count up from 0
            for link in range(-1, pybullet.getNumJoints(body, physicsClientId=self.client)):
                yield (body, link), self._default_filter(body, link)

    def _filter(self, body: int, link: int, group_and_mask: tuple[int, int]) -> None:
        pybullet.setCollisionFilterGroupMask(body, link, *group_and_mask, physicsClientId=self.client)

    def _default_filter(self, body: int, link: int) -> tuple[int, int]:
        if body in self._ground_only:
            return _GROUND_ONLY
        mass = pybullet.getDynamicsInfo(body, -1, physicsClientId=self.client)[0]
        return _STATIC if link == -1 and math.isclose(mass, 0.0) else _DYNAMIC
