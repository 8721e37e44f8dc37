"""The scene of the stable push in MuJoCo: the same numbers, the same channels, another engine."""

from collections.abc import Iterable, Sequence
from typing import Any, Final

import numpy as np
from jaxtyping import Float

from workers.environments.drive import SpeedDrive
from workers.environments.environment import Command, Observed
from workers.environments.tabletop import ArmScene, TabletopModel
from workers.mujoco import scene
from workers.mujoco.arm import MujocoArm, arm_scene, hand_link, moving_links, solid_links
from workers.mujoco.description import compile_scene
from workers.mujoco.simulation import Simulation
from workers.physics import Physics
from workers.plans import HandPlan, JointPlan, PlannedCommand

SPEED_GAIN: Final = 30.0
"""A motor that seeks a speed has so many N·m per rad/s it is wrong; with 2,000 the servos chatter."""

Record = Float[np.ndarray, " width"]
"""It holds joint angles, each object's position and quaternion, the hand's position, and table contact (0 or
1)."""


class MujocoTabletop(ArmScene):
    """The scene in MuJoCo.

    Friction, rolling friction, masses and restitution (`workers.mujoco.scene`) are modelled; fingers are
    stiff instead of held shut.

    Args:
        model: of the scene.
    """

    def __init__(self, model: TabletopModel) -> None:
        super().__init__(model)
        self._objects = [f"object{number}" for number in range(1, len(model.cylinders) + 1)]
        spec = arm_scene(model.arm)
        self._links = solid_links(spec, model.arm)
        self._furnish(spec)
        self._hand = hand_link(model.arm)
        self._simulation = Simulation(
            compile_scene(spec, model.arm.urdf),
            joints=model.arm.joints,
            poses=self._objects,
            point=self._hand,
        )
        self.arm = MujocoArm(self._simulation, model.arm)

    def _furnish(self, spec: Any) -> None:
        """Add motors, the ground and the objects to the scene of the arm."""
        model = self._model
        scene.set_time_step(spec, model.control_step)
        for joint in model.arm.joints:
            if isinstance(model.drive, SpeedDrive):
                scene.add_servo(spec, joint, stiffness=0.0, damping=SPEED_GAIN, torque=model.drive.force)
            else:
                scene.add_torque_motor(spec, joint)
        if isinstance(model.drive, SpeedDrive):
            scene.float_links(spec, model.arm.joints[0])
        moving = moving_links(spec, model.arm)
        scene.add_ground(spec)
        for link in moving:
            scene.add_pair(spec, link, scene.GROUND, rolls=False)
        for number, (name, cylinder) in enumerate(zip(self._objects, model.cylinders, strict=True)):
            scene.add_cylinder(
                spec, name, radius=cylinder.radius, height=cylinder.height, position=cylinder.start
            )
            for other in (scene.GROUND, *self._links, *self._objects[:number]):
                scene.add_pair(spec, name, other, rolls=True)
        scene.add_touch_sensor(spec, spec.geom(moving[0]).parent.name, with_children=True)

    def reset(self, physics: Physics) -> None:
        """Arm at home, objects at their start, with the dynamics named in `physics`."""
        arm = self._model.arm
        for number in range(len(self._objects)):
            self._set_dynamics(number, physics)
        self._simulation.reset(zip(arm.joints, arm.home, strict=True))

    def _set_dynamics(self, number: int, physics: Physics) -> None:
        """Mass and contacts of an object; coefficients of a contact are the products of both sides'."""
        model, name, cylinder = self._simulation.model, self._objects[number], self._model.cylinders[number]
        mass = physics[f"{name}_mass"]
        across = mass * (3 * cylinder.radius**2 + cylinder.height**2) / 12
        scene.set_mass(model, name, mass, (across, across, mass * cylinder.radius**2 / 2))
        friction, rolling, restitution = self._coefficients(name, physics)
        others = [(scene.GROUND, (1.0, 0.0, 1.0))]
        others += [(link, (scene.LINK_FRICTION, 0.0, 0.0)) for link in self._links]
        others += [(other, self._coefficients(other, physics)) for other in self._objects[:number]]
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

    def step(self, command: Sequence[float]) -> Record:
        """Drive the joints for one control step."""
        self._simulation.step(command)
        return self.record()

    def record(self) -> Record:
        """See `Record`."""
        return self._simulation.record()

    def run_commands(self, command: Command, steps: int) -> Any:
        """Apply the commands of an episode; those that follow a plan in compiled code.

        Args:
            command: of each step.
            steps: how many.

        Returns:
            The record of each step, together as `observed` takes them.
        """
        plan = command.plan if isinstance(command, PlannedCommand) else None
        if isinstance(plan, HandPlan):
            return self._simulation.run_hand(plan, self._hand)
        if isinstance(plan, JointPlan):
            return self._simulation.run_joints(plan, self._model.arm.joints)
        return super().run_commands(command, steps)

    def observed(self, records: Iterable[Record]) -> Observed:
        """ξ in the order of `observation`; signals: `hand_position` [3, T] and `table_contact` [T]."""
        return self._read_columns(np.asarray(records).T)

    def close(self) -> None:
        """Nothing is open."""
