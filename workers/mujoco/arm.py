"""An arm bolted to the world, in a scene of MuJoCo; to a controller it is what PyBullet's arm is."""

from typing import Any, NamedTuple

import mujoco
import numpy as np

from workers.mujoco.description import child_links, read_robot
from workers.mujoco.scene import set_joint
from workers.mujoco.simulation import Simulation
from workers.simulation.arm import ArmModel, ArmReadings, ArmState, Vector
from workers.simulation.description import require_joints, robot_path


class MujocoArm(ArmReadings):
    """What controllers read of an arm.

    Args:
        simulation: of the scene that it stands in, in which its joints come first.
        joints: how many they are.
        hand: name of its hand's link.
    """

    def __init__(self, simulation: Simulation, joints: int, hand: str) -> None:
        self._simulation = simulation
        self._count = joints
        self._body = simulation.model.body(hand).id

    @property
    def state(self) -> ArmState:
        """The arm as it is now."""
        model, data = self._simulation.model, self._simulation.data
        velocity = np.empty(6)
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_XBODY, self._body, velocity, 0)
        w, x, y, z = data.xquat[self._body].tolist()
        return ArmState(
            joints=tuple(data.qpos[: self._count].tolist()),
            speeds=tuple(data.qvel[: self._count].tolist()),
            position=tuple(data.xpos[self._body].tolist()),
            orientation=(x, y, z, w),
            velocity=tuple(velocity[3:].tolist()),
            angular_velocity=tuple(velocity[:3].tolist()),
        )

    def jacobian(self) -> tuple[tuple[Vector, ...], tuple[Vector, ...]]:
        """Linear and angular Jacobian of the hand's origin, 3 rows each; the first columns are the joints."""
        model, data = self._simulation.model, self._simulation.data
        linear, angular = np.empty((3, model.nv)), np.empty((3, model.nv))
        mujoco.mj_jacBody(model, data, linear, angular, self._body)
        return tuple(map(tuple, linear.tolist())), tuple(map(tuple, angular.tolist()))

    def gravity_torque(self) -> Vector:
        """Torques, in N·m, against gravity, Coriolis and centrifugal forces."""
        return tuple(self._simulation.data.qfrc_bias[: self._count].tolist())


def arm_scene(model: ArmModel) -> Any:
    """Begin a scene with an arm: its joints as the model has them, its fingers stiff, motors still missing.

    Args:
        model: of the arm.

    Returns:
        A `mujoco.MjSpec`.

    Raises:
        ValueError: MuJoCo does not take the description, or a joint is missing.
    """
    path = robot_path(model.urdf)
    spec = read_robot(path)
    require_joints([joint.name for joint in spec.joints], path, (*model.joints, *model.fingers))
    for equality in list(spec.equalities):  # fingers that mimic each other
        spec.delete(equality)
    for finger in model.fingers:
        spec.delete(spec.joint(finger))
    for name, low, high in zip(model.joints, model.lower, model.upper, strict=True):
        set_joint(spec, name, limits=(low, high), damping=model.joint_damping)
    spec.worldbody.first_body().pos = model.base
    return spec


class ArmLinks(NamedTuple):
    """Links of an arm, whose geoms have the same names.

    Attributes:
        hand: the one whose frame is the hand.
        first: the one nearest to the base that moves.
        solid: geoms that touch things, the base's first: all but the fingers'.
        moving: those of them that move.
    """

    hand: str
    first: str
    solid: tuple[str, ...]
    moving: tuple[str, ...]


def arm_links(spec: Any, model: ArmModel) -> ArmLinks:
    """Find the links of an arm.

    Args:
        spec: of the arm alone, as from `arm_scene`.
        model: of the arm.

    Returns:
        Their names.
    """
    children = child_links(robot_path(model.urdf))
    fingers = {children[finger] for finger in model.fingers}
    first = spec.body(children[model.joints[0]])
    moved = {body.name for body in (first, *first.find_all("body"))}
    solid = [geom for geom in spec.geoms if geom.parent.name not in fingers]
    return ArmLinks(
        hand=children[model.hand],
        first=first.name,
        solid=tuple(geom.name for geom in solid),
        moving=tuple(geom.name for geom in solid if geom.parent.name in moved),
    )
