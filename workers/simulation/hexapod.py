"""A walking robot with a free base: wanted joint angles in; joints, pose and contacts out."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from tempfile import NamedTemporaryFile

from workers.simulation.bullet import pybullet
from workers.simulation.world import World

Vector = tuple[float, ...]

_ANY_LINK, _BASE = -2, -1
_LINK, _DISTANCE = 3, 8  # in a contact point of PyBullet: the first body's link, and the gap in m
_REST = (0.0, 0.0, 0.0)
_UPRIGHT = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class HexapodModel:
    """What is needed to load a walking robot and to move it.

    Attributes:
        urdf: the description itself, as text; its root link is the body.
        joints: names of the joints that move, all the description has, in its order.
        feet: names of the joints whose links may touch the ground.
        home: joint angles at reset, in rad.
        height: of the body's origin at reset, in m.
        center: of the body's mass, from its origin, in m.
        torques: greatest of each motor, in N·m.
        speeds: greatest of each motor, in rad/s; infinite where a motor is not limited.
        stiffness: share of a position error that a motor removes per simulation step (Bullet's gain).
        damping: share of a velocity error that a motor removes per simulation step (Bullet's gain).
    """

    urdf: str
    joints: tuple[str, ...]
    feet: tuple[str, ...]
    home: tuple[float, ...]
    height: float
    center: tuple[float, float, float]
    torques: tuple[float, ...]
    speeds: tuple[float, ...]
    stiffness: float
    damping: float

    def __post_init__(self) -> None:
        """Refuse values that do not fit the joints."""
        for name in ("home", "torques", "speeds"):
            count = len(getattr(self, name))
            if count != len(self.joints):
                raise ValueError(f"{name} must hold one number per joint ({len(self.joints)}), got {count}")
        if len({math.isinf(speed) for speed in self.speeds}) != 1:
            raise ValueError(f"speeds must be all finite or all infinite, got {self.speeds}")


class Hexapod:
    """A walking robot in a world, standing over the origin after `reset`."""

    def __init__(self, world: World, model: HexapodModel) -> None:
        self._client = world.client
        self._plane = world.plane
        self._model = model
        self.body: int = self._load(model.urdf)
        world.touch_ground_only(self.body)
        found = self._joint_names()
        if found != list(model.joints):
            odd = next(name for name in (*model.joints, *found) if (name in found) != (name in model.joints))
            raise ValueError(f"the robot's joints must be {', '.join(model.joints)}; {odd!r} does not fit")
        self._joints = list(range(len(found)))
        self._feet = frozenset(found.index(name) for name in model.feet)
        self._gains = [model.stiffness] * len(found), [model.damping] * len(found)
        self.drive = self._drive_freely if math.isinf(model.speeds[0]) else self._drive_slowly

    def _load(self, urdf: str) -> int:
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_IGNORE_VISUAL_SHAPES
        with NamedTemporaryFile("w", encoding="utf-8", suffix=".urdf") as file:  # Bullet reads files only
            file.write(urdf)
            file.flush()
            try:
                return pybullet.loadURDF(file.name, flags=flags, physicsClientId=self._client)
            except pybullet.error as error:
                raise ValueError(
                    f"the robot's description must be a URDF that Bullet can load, got {urdf[:60]!r}: {error}"
                ) from error

    def _joint_names(self) -> list[str]:
        count = pybullet.getNumJoints(self.body, physicsClientId=self._client)
        infos = (pybullet.getJointInfo(self.body, i, physicsClientId=self._client) for i in range(count))
        return [info[1].decode() for info in infos]

    def set_dynamics(self, *, friction: float, restitution: float, damping: float) -> None:
        """Set the contact coefficients and the damping of every link.

        Args:
            friction: coefficient of sliding.
            restitution: share of the speed kept in a bounce.
            damping: linear and angular, in 1/s.
        """
        for link in (_BASE, *self._joints):
            pybullet.changeDynamics(
                self.body,
                link,
                lateralFriction=friction,
                restitution=restitution,
                linearDamping=damping,
                angularDamping=damping,
                physicsClientId=self._client,
            )

    def reset(self) -> None:
        """Put the robot to its home pose above the ground, at rest."""
        model, client = self._model, self._client
        for joint, angle in zip(self._joints, model.home, strict=True):
            pybullet.resetJointState(self.body, joint, angle, 0.0, physicsClientId=client)
        x, y, z = model.center  # Bullet places the centre of mass
        start = (x, y, z + model.height)
        pybullet.resetBasePositionAndOrientation(self.body, start, _UPRIGHT, physicsClientId=client)
        pybullet.resetBaseVelocity(self.body, _REST, _REST, physicsClientId=client)
        self.drive(model.home)

    def _drive_freely(self, targets: Sequence[float]) -> None:
        """Set the joint angles, in rad, that the motors aim at from the next step on."""
        stiffness, damping = self._gains
        pybullet.setJointMotorControlArray(
            self.body,
            self._joints,
            pybullet.POSITION_CONTROL,
            targetPositions=targets,
            forces=self._model.torques,
            positionGains=stiffness,
            velocityGains=damping,
            physicsClientId=self._client,
        )

    def _drive_slowly(self, targets: Sequence[float]) -> None:
        """The same within the motors' speeds, which only the call for a single joint takes."""
        model = self._model
        rows = zip(self._joints, targets, model.torques, model.speeds, strict=True)
        for joint, target, torque, speed in rows:
            pybullet.setJointMotorControl2(
                self.body,
                joint,
                pybullet.POSITION_CONTROL,
                targetPosition=target,
                force=torque,
                maxVelocity=speed,
                positionGain=model.stiffness,
                velocityGain=model.damping,
                physicsClientId=self._client,
            )

    def joints(self) -> Iterable[Vector]:
        """Joint angles in rad, then joint speeds in rad/s."""
        states = pybullet.getJointStates(self.body, self._joints, self._client)
        angles, speeds, _, _ = zip(*states, strict=True)
        return angles, speeds

    def pose(self) -> tuple[Vector, Vector]:
        """Position in m of the body's centre of mass, and orientation as a quaternion (x, y, z, w)."""
        return pybullet.getBasePositionAndOrientation(self.body, self._client)

    def scrapes(self) -> bool:
        """Whether anything but the feet's links is in contact with the ground."""
        feet = self._feet
        contacts = pybullet.getContactPoints(self.body, self._plane, _ANY_LINK, _ANY_LINK, self._client)
        return any([contact[_LINK] not in feet and contact[_DISTANCE] < 0.0 for contact in contacts])
