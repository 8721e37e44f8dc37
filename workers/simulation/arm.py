"""An arm bolted to the world: torques or speeds in, joints out, kinematics and dynamics on request."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from workers.simulation.bullet import pybullet
from workers.simulation.description import joint_indices, load_robot, robot_path
from workers.simulation.world import World

Vector = tuple[float, ...]

UNLIMITED = 100.0  # rad/s; Bullet's own limit of joint speeds, which nothing here reaches
_ORIGIN = (0.0, 0.0, 0.0)
_ANY_LINK, _NO_FLAGS = -2, 0
_LINK, _DISTANCE = 3, 8  # in a contact point of PyBullet: the first body's link, and the gap in m


class ArmState(NamedTuple):
    """One reading of an arm; a tuple, for one is built in every step.

    Attributes:
        joints: angles in rad.
        speeds: angular speeds in rad/s.
        position: origin of the hand's frame in m, in the world.
        orientation: of the hand's frame, quaternion (x, y, z, w).
        velocity: of that origin in m/s.
        angular_velocity: of the hand in rad/s.
    """

    joints: Vector
    speeds: Vector
    position: Vector
    orientation: Vector
    velocity: Vector
    angular_velocity: Vector


@dataclass(frozen=True)
class ArmModel:
    """What is needed to load an arm and to move it.

    Attributes:
        urdf: path below the folder of robots that ships with PyBullet, or an absolute path.
        joints: names of the joints that move, base to tip.
        lower: lower joint limits in rad.
        upper: upper joint limits in rad.
        home: joint angles at reset in rad.
        joint_damping: N·m·s/rad at each moving joint.
        speed_limit: rad/s that no joint passes; one number, for Bullet clips all joints of a body alike
            (`changeDynamics` of another joint overwrites the first).
        base: origin of the arm in the world, in m.
        hand: name of the joint that carries the link whose frame is the hand.
        fingers: names of the prismatic joints held shut, whose links touch nothing.
        finger_force: N that holds each of them.
    """

    urdf: str
    joints: tuple[str, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    home: tuple[float, ...]
    joint_damping: float
    speed_limit: float
    base: tuple[float, float, float]
    hand: str
    fingers: tuple[str, ...]
    finger_force: float

    def __post_init__(self) -> None:
        """Refuse limits and home poses that do not fit the joints."""
        for name in ("lower", "upper", "home"):
            if len(getattr(self, name)) != len(self.joints):
                count = len(getattr(self, name))
                raise ValueError(f"{name} must hold one angle per joint ({len(self.joints)}), got {count}")
        for joint, low, start, high in zip(self.joints, self.lower, self.home, self.upper, strict=True):
            if not low <= start <= high:
                raise ValueError(f"home of {joint} must lie within [{low}, {high}] rad, got {start}")


class ArmReadings(Protocol):
    """What controllers read of an arm, whatever simulates it."""

    @property
    def state(self) -> ArmState:
        """The arm as it is now."""

    def jacobian(self) -> tuple[tuple[Vector, ...], tuple[Vector, ...]]:
        """Linear and angular Jacobian of the hand's origin, 3 rows each; the first columns are the joints."""

    def gravity_torque(self) -> Vector:
        """Torques, in N·m, against gravity, Coriolis and centrifugal forces; the arm's joints come first."""


class Arm:
    """An arm in a world, at its home pose after `reset`."""

    def __init__(self, world: World, model: ArmModel) -> None:
        self._world = world
        self._client = world.client
        self._model = model
        self.body = self._load(model)
        needed = (*model.joints, model.hand, *model.fingers)
        index = joint_indices(self.body, self._client, model.urdf, needed)
        self._joints = [index[name] for name in model.joints]
        self._fingers = [index[name] for name in model.fingers]
        self._hand = index[model.hand]
        self._rest = (0.0,) * (len(self._joints) + len(self._fingers))
        self._finger_rest = (0.0,) * len(self._fingers)
        self._configure()
        self.state = self._read()

    def _load(self, model: ArmModel) -> int:
        # Nobody looks: the meshes that are only seen would take 100 MB.
        flags = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_IGNORE_VISUAL_SHAPES
        path = robot_path(model.urdf)
        return load_robot(path, self._client, basePosition=model.base, useFixedBase=True, flags=flags)

    def _configure(self) -> None:
        model = self._model
        for joint, low, high in zip(self._joints, model.lower, model.upper, strict=True):
            pybullet.changeDynamics(
                self.body,
                joint,
                jointLowerLimit=low,
                jointUpperLimit=high,
                jointDamping=model.joint_damping,
                physicsClientId=self._client,
            )
        # Together with joint limits in one call it would spoil the limits, and the arm explodes.
        pybullet.changeDynamics(
            self.body, self._joints[0], maxJointVelocity=model.speed_limit, physicsClientId=self._client
        )
        self._world.make_intangible(self.body, self._fingers)

    def reset(self) -> None:
        """Put the arm to its home pose, at rest, with its motors off and its fingers shut."""
        for joint, angle in zip(self._joints, self._model.home, strict=True):
            pybullet.resetJointState(self.body, joint, angle, 0.0, physicsClientId=self._client)
        for joint in self._fingers:
            pybullet.resetJointState(self.body, joint, 0.0, 0.0, physicsClientId=self._client)
        pybullet.setJointMotorControlArray(
            self.body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            forces=[0.0] * len(self._joints),
            physicsClientId=self._client,
        )
        pybullet.setJointMotorControlArray(
            self.body,
            self._fingers,
            pybullet.POSITION_CONTROL,
            targetPositions=self._finger_rest,
            forces=[self._model.finger_force] * len(self._fingers),
            physicsClientId=self._client,
        )
        self.state = self._read()

    def apply_torque(self, torque: Sequence[float]) -> None:
        """Set the joint torques, in N·m, of the next step."""
        pybullet.setJointMotorControlArray(
            self.body, self._joints, pybullet.TORQUE_CONTROL, forces=torque, physicsClientId=self._client
        )

    def apply_speed(self, speed: Sequence[float], force: Sequence[float]) -> None:
        """Set the joint speeds that motors seek in the next step.

        Args:
            speed: rad/s, one per moving joint.
            force: N·m that each motor has for it.
        """
        pybullet.setJointMotorControlArray(
            self.body,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=speed,
            forces=force,
            physicsClientId=self._client,
        )

    def refresh(self) -> ArmState:
        """Read the arm after a step."""
        self.state = self._read()
        return self.state

    def _read(self) -> ArmState:
        joints = pybullet.getJointStates(self.body, self._joints, self._client)
        # With velocities and forward kinematics: without it Bullet answers with the poses of one step before.
        center, _, _, _, origin, orientation, velocity, spin = pybullet.getLinkState(
            self.body, self._hand, 1, 1, self._client
        )
        angles, speeds, _, _ = zip(*joints, strict=True)
        self._all_angles = angles + self._finger_rest
        return ArmState(
            angles, speeds, origin, orientation, _shift_velocity(velocity, spin, center, origin), spin
        )

    def jacobian(self) -> tuple[tuple[Vector, ...], tuple[Vector, ...]]:
        """Linear and angular Jacobian of the hand's origin, 3 rows each; the first columns are the joints."""
        return pybullet.calculateJacobian(
            self.body, self._hand, _ORIGIN, self._all_angles, self._rest, self._rest, self._client
        )

    def gravity_torque(self) -> Vector:
        """Torques, in N·m, against gravity, Coriolis and centrifugal forces; the fingers come last."""
        speeds = self.state.speeds + self._finger_rest
        return pybullet.calculateInverseDynamics(
            self.body, self._all_angles, speeds, self._rest, _NO_FLAGS, self._client
        )

    def touches(self, body: int) -> bool:
        """Whether any link but the base is in contact with the body."""
        contacts = pybullet.getContactPoints(self.body, body, _ANY_LINK, _ANY_LINK, self._client)
        # Mostly there are none, and a generator costs as much as the query.
        return bool(contacts) and any(c[_LINK] >= 0 and c[_DISTANCE] < 0.0 for c in contacts)


def _shift_velocity(velocity: Vector, spin: Vector, center: Vector, origin: Vector) -> Vector:
    """Velocity v + ω × (origin − centre) of a link's origin, from that of its centre of mass."""
    vx, vy, vz = velocity
    wx, wy, wz = spin
    dx, dy, dz = origin[0] - center[0], origin[1] - center[1], origin[2] - center[2]
    return (vx + wy * dz - wz * dy, vy + wz * dx - wx * dz, vz + wx * dy - wy * dx)
