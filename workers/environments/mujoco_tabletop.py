"""The scene of the stable push in MuJoCo: the same numbers, the same channels, another engine."""

from collections.abc import Iterable
from typing import Any, Final

import numpy as np

from workers.environments.drive import SpeedDrive
from workers.environments.environment import Observed
from workers.environments.mujoco_environment import MujocoEnvironment, Record
from workers.environments.tabletop import ArmScene, TabletopModel
from workers.mujoco import scene
from workers.mujoco.arm import MujocoArm, arm_links, arm_scene
from workers.mujoco.description import compile_scene
from workers.mujoco.simulation import Simulation
from workers.physics import Physics
from workers.simulation.cylinder import moments

SPEED_GAIN: Final = 30.0
"""A motor that seeks a speed has so many N·m per rad/s it is wrong; with 2,000 the servos chatter."""


class MujocoTabletop(MujocoEnvironment, ArmScene):
    """The scene in MuJoCo.

    Friction, rolling friction, masses and restitution (`workers.mujoco.scene`) are modelled; fingers are
    stiff instead of held shut.

    Args:
        model: of the scene.
    """

    def __init__(self, model: TabletopModel) -> None:
        super().__init__(model)
        spec = arm_scene(model.arm)
        self._links = arm_links(spec, model.arm)
        self._furnish(spec)
        self.simulation = Simulation(
            compile_scene(spec, model.arm.urdf),
            joints=model.arm.joints,
            poses=model.objects,
            point=self._links.hand,
        )
        self.arm = MujocoArm(self.simulation, len(model.arm.joints), self._links.hand)

    def _furnish(self, spec: Any) -> None:
        """Add motors, the ground and the objects to the scene of the arm."""
        model, links = self._model, self._links
        scene.set_time_step(spec, model.control_step)
        _add_motors(spec, model, links.first)
        scene.add_ground(spec)
        for link in links.moving:
            scene.add_pair(spec, link, scene.GROUND, rolls=False)
        scene.add_touch_sensor(spec, links.first, with_children=True)
        for number, (name, cylinder) in enumerate(zip(model.objects, model.cylinders, strict=True)):
            scene.add_cylinder(
                spec, name, radius=cylinder.radius, height=cylinder.height, position=cylinder.start
            )
            for other in (scene.GROUND, *links.solid, *model.objects[:number]):
                scene.add_pair(spec, name, other, rolls=True)

    def reset(self, physics: Physics) -> None:
        """Arm at home, objects at their start, with the dynamics named in `physics`."""
        arm = self._model.arm
        for number in range(len(self._model.objects)):
            self._set_dynamics(number, physics)
        self.simulation.reset(zip(arm.joints, arm.home, strict=True))

    def _set_dynamics(self, number: int, physics: Physics) -> None:
        """Mass and contacts of an object; coefficients of a contact are the products of both sides'."""
        model, objects = self.simulation.model, self._model.objects
        name, cylinder = objects[number], self._model.cylinders[number]
        mass = physics[f"{name}_mass"]
        scene.set_mass(model, name, mass, moments(mass, cylinder.radius, cylinder.height))
        friction, rolling, restitution = self._coefficients(name, physics)
        others = [(scene.GROUND, (1.0, 0.0, 1.0))]
        others += [(link, (scene.LINK_FRICTION, 0.0, 0.0)) for link in self._links.solid]
        others += [(other, self._coefficients(other, physics)) for other in objects[:number]]
        for other, (its_friction, its_rolling, its_restitution) in others:
            scene.set_contact(
                model,
                scene.pair_name(name, other),
                friction=friction * its_friction,
                rolling_friction=friction * its_rolling + its_friction * rolling,
                restitution=restitution * its_restitution,
            )

    @staticmethod
    def _coefficients(name: str, physics: Physics) -> tuple[float, float, float]:
        """Of sliding, of rolling, and of restitution."""
        kinds = ("friction", "rolling_friction", "restitution")
        sliding, rolling, restitution = (physics[f"{name}_{kind}"] for kind in kinds)
        return sliding, rolling, restitution

    def observed(self, records: Iterable[Record]) -> Observed:
        """ξ in the order of `observation`; signals: `hand_position` [3, T] and `table_contact` [T]."""
        return self._read_columns(np.asarray(records).T)


def _add_motors(spec: Any, model: TabletopModel, first: str) -> None:
    """Motors of torques, or of speeds; those leave the arm's weight, from its first link on, to nobody."""
    if not isinstance(model.drive, SpeedDrive):
        for joint in model.arm.joints:
            scene.add_torque_motor(spec, joint)
        return
    scene.float_links(spec, first)
    for joint in model.arm.joints:
        scene.add_servo(spec, joint, stiffness=0.0, damping=SPEED_GAIN, torque=model.drive.force)
