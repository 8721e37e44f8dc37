"""An arm bolted to the world, in a scene of MuJoCo; to a controller it is what PyBullet's arm is."""

from typing import Any

import mujoco
import numpy as np

from workers.mujoco.description import child_links, read_robot, require_joints
from workers.mujoco.scene import set_joint
from workers.mujoco.simulation import Simulation
from workers.simulation.arm import ArmModel, ArmReadings, ArmState, Vector
from workers.simulation.description import robot_path


class MujocoArm(ArmReadings):
    """What controllers read of an arm.

    Args:
        simulation: of the scene that it stands in, in which its joints come first.
        model: of it.
    """

    def __init__(self, simulation: Simulation, model: ArmModel) -> None:
        self._simulation = simulation
        self._count = len(model.joints)
        self._body = simulation.model.body(hand_link(model)).id

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
    require_joints(spec, path, (*model.joints, *model.fingers))
    for equality in list(spec.equalities):  # fingers that mimic each other
        spec.delete(equality)
    for finger in model.fingers:
        spec.delete(spec.joint(finger))
    for name, low, high in zip(model.joints, model.lower, model.upper, strict=True):
        set_joint(spec, name, limits=(low, high), damping=model.joint_damping)
    spec.worldbody.first_body().pos = model.base
    return spec


def hand_link(model: ArmModel) -> str:
    """Name of the link whose frame is the hand."""
    return child_links(robot_path(model.urdf))[model.hand]


def solid_links(spec: Any, model: ArmModel) -> list[str]:
    """Name the geoms of an arm that touch things: all but the fingers'.

    Args:
        spec: of the arm alone.
        model: of the arm.

    Returns:
        Their names, the base's first.
    """
    children = child_links(robot_path(model.urdf))
    fingers = {children[finger] for finger in model.fingers}
    return [geom.name for geom in spec.geoms if geom.parent.name not in fingers]


def moving_links(spec: Any, model: ArmModel) -> list[str]:
    """Name the geoms of an arm that touch things and move.

    Args:
        spec: of the arm alone.
        model: of the arm.

    Returns:
        Their names, from base to tip.
    """
    base = spec.body(child_links(robot_path(model.urdf))[model.joints[0]])
    moved = {body.name for body in (base, *base.find_all("body"))}
    return [name for name in solid_links(spec, model) if spec.geom(name).parent.name in moved]
