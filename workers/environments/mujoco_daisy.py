"""Daisy on flat ground in MuJoCo: the same numbers, the same channels, another engine."""

from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from workers.environments.daisy import CONTROL_STEP, ROBOT, SCENERY, SUBSTEPS, DaisyModel, observation
from workers.environments.daisy_body import JOINTS
from workers.environments.environment import Observed
from workers.environments.mujoco_environment import MujocoEnvironment, Record
from workers.environments.tabletop import first_two_axes
from workers.mujoco import scene
from workers.mujoco.description import compile_scene, read_robot
from workers.mujoco.simulation import Simulation
from workers.physics import Physics

MOTOR_DAMPING: Final = 20.0
"""kd of the motors, in N·m·s/rad. Bullet's motor is a constraint: in each of its steps it removes a share of
the position error, `stiffness`, that is, it seeks the speed stiffness · error / step, with all its torque."""

_BODY = "body"


class MujocoDaisy(MujocoEnvironment):
    """Daisy on the plane z = 0, its motors aiming at the commanded joint angles.

    Friction, restitution (`workers.mujoco.scene`) and the links' damping are modelled; the last takes its
    share of every velocity in each step of the engine.

    Args:
        model: of the robot, whose motors have no limit of speed.
    """

    control_step = CONTROL_STEP
    scenery = SCENERY

    def __init__(self, model: DaisyModel) -> None:
        if np.isfinite(model.speeds).any():
            raise ValueError(
                f"speeds must be infinite, for motors have no limit of speed here, got {model.speeds}"
            )
        self.observation = observation()
        self.action = model.action()
        spec = read_robot(ROBOT.urdf)
        self._parts = [geom.name for geom in spec.geoms]
        _furnish(spec)
        self.simulation = Simulation(
            compile_scene(spec, "Daisy"), joints=JOINTS, poses=(_BODY,), with_speeds=JOINTS, substeps=SUBSTEPS
        )

    def reset(self, physics: Physics) -> None:
        """The robot at home, 5 mm above the height at which it stands, with the dynamics of `physics`."""
        simulation = self.simulation
        for part in self._parts:
            scene.set_contact(
                simulation.model,
                scene.pair_name(part, scene.GROUND),
                friction=physics["friction"],
                rolling_friction=0.0,
                restitution=physics["restitution"],
            )
        simulation.keep = 1.0 - physics["link_damping"] * CONTROL_STEP / SUBSTEPS
        simulation.reset(zip(JOINTS, ROBOT.home, strict=True))

    def observed(self, records: Iterable[Record]) -> Observed:
        """ξ in the order of `observation`; signals: `joint_speeds` [18, T] and `elbow_contact` [T]."""
        columns = np.asarray(records).T
        angles, origin, quaternion, speeds = np.split(columns[:-1], np.cumsum([len(JOINTS), 3, 4]).tolist())
        return Observed(
            xi=np.concatenate([angles, origin, first_two_axes(quaternion.T)]).astype(np.float32),
            signals={"joint_speeds": speeds, "elbow_contact": columns[-1] != 0.0},
        )


def _furnish(spec: Any) -> None:
    """Put the robot over the ground, free, with a motor at every joint."""
    parts, bodies = [geom.name for geom in spec.geoms], [body.name for body in spec.bodies]
    scene.set_time_step(spec, CONTROL_STEP / SUBSTEPS)
    root = spec.body(_BODY)
    root.pos = (0.0, 0.0, ROBOT.height)
    root.add_freejoint(name=_BODY)
    for joint, torque in zip(JOINTS, ROBOT.torques, strict=True):
        stiffness = MOTOR_DAMPING * ROBOT.stiffness * SUBSTEPS / CONTROL_STEP
        scene.add_servo(spec, joint, stiffness=stiffness, damping=MOTOR_DAMPING, torque=torque)
    scene.add_ground(spec)
    for part in parts:
        scene.add_pair(spec, part, scene.GROUND, rolls=False)
    feet = {f"{foot.removesuffix('_elbow')}_tibia" for foot in ROBOT.feet}
    for body in bodies:
        if body not in feet and body != "world":
            scene.add_touch_sensor(spec, body, with_children=False)
