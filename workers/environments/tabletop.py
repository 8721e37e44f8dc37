"""An arm in front of a table with tall cylinders on it: the scene of the stable push."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from struct import Struct

import numpy as np
from jaxtyping import Float

from workers.environments.drive import Drive
from workers.environments.environment import Channel, Environment, Observed
from workers.physics import Physics, PhysicsRanges, around
from workers.simulation.arm import Arm, ArmModel, ArmReadings
from workers.simulation.cylinder import Cylinder
from workers.simulation.scenery import Camera, Ground, Interval, Machine, Roll, Scenery
from workers.simulation.world import World


@dataclass(frozen=True)
class CylinderModel:
    """A cylinder of the scene: radius and height in m, start (x, y) in m, nominal physics by name."""

    radius: float
    height: float
    start: tuple[float, float]
    nominal: Mapping[str, float]


@dataclass(frozen=True)
class TabletopModel:
    """Everything that tells one tabletop scene from another.

    Attributes:
        arm: the robot.
        drive: what a command means, and its limits.
        cylinders: the objects to push.
        control_step: seconds, also the step of the simulation.
        solver_iterations: of the contact solver in each step.
        table: extent along x and y of the task's part of the plane, in m; pictures show it.
    """

    arm: ArmModel
    drive: Drive
    cylinders: tuple[CylinderModel, ...]
    control_step: float
    solver_iterations: int
    table: tuple[Interval, Interval]

    @property
    def objects(self) -> tuple[str, ...]:
        """Their names, `object1` and so on, in channels and in physics."""
        return tuple(f"object{number}" for number in range(1, len(self.cylinders) + 1))

    def nominal_physics(self) -> dict[str, float]:
        """Nominal values of all randomised parameters: `object1_mass` (kg) and so on."""
        return {
            f"{own}_{name}": value
            for own, cylinder in zip(self.objects, self.cylinders, strict=True)
            for name, value in cylinder.nominal.items()
        }

    def gaps(self) -> dict[str, PhysicsRanges]:
        """Levels of the sim-to-real gap; `paper` varies all but the rolling friction."""
        nominal = self.nominal_physics()
        training = around(nominal, 0.05)
        fixed = {name: (value, value) for name, value in nominal.items() if "rolling" in name}
        return {
            "paper": PhysicsRanges({**training.intervals, **fixed}),
            "training": training,
            "wide": around(nominal, 0.2),
        }

    def observation(self) -> tuple[Channel, ...]:
        """Joint angles (rad), then per object its position (m) and two columns of its rotation matrix."""
        slack = 0.1  # rad; the solver lets joints overshoot their limits a little
        arm = self.arm
        joints = [
            Channel(name, "rad", low - slack, high + slack)
            for name, low, high in zip(arm.joints, arm.lower, arm.upper, strict=True)
        ]
        objects = [channel for name in self.objects for channel in _object_channels(name)]
        return (*joints, *objects)

    def action(self) -> tuple[Channel, ...]:
        """One number per joint that moves."""
        limits = zip(self.arm.joints, self.drive.limits, strict=True)
        return tuple(Channel(name, self.drive.unit, -limit, limit) for name, limit in limits)

    def scenery(self) -> Scenery:
        """The arm, its objects and the table, from above the side that they are pushed to."""
        arm = Machine(Path(self.arm.urdf), self.arm.joints, self.arm.base)
        rolls = (Roll(c.radius, c.height, name) for name, c in zip(self.objects, self.cylinders, strict=True))
        x, y = (float(mean) for mean in np.mean([c.start for c in self.cylinders], axis=0))
        return Scenery(
            bodies=(arm, *rolls),
            ground=Ground(0.1, *self.table, numbered=()),
            camera=Camera(
                target=(x, 0.0, 0.27),
                follows="",
                distance=1.75,
                yaw=90.0 - math.copysign(32.0, y),
                pitch=-33.0,
                angle=38.0,
            ),
        )


def _object_channels(name: str) -> list[Channel]:
    positions = [Channel(f"{name}_{axis}", "m", -3.0, 3.0) for axis in "xyz"]
    columns = product(("first", "second"), "xyz")
    return positions + [Channel(f"{name}_{column}_axis_{axis}", "1", -1.0, 1.0) for column, axis in columns]


_FAR = 1e3  # m, rad and rad/s

Record = bytes
"""It packs doubles: joint angles, each object's position and quaternion, the hand's position, table contact
(0 or 1).

It is bytes because thousands of float objects kept alive would push the simulator's data out of the caches:
with tuples an episode took a tenth longer.
"""


class ArmScene(Environment):
    """An arm over a table, in whichever engine; the table's surface is the plane z = 0.

    Args:
        model: of the scene.

    Attributes:
        arm: what controllers read of it.
    """

    arm: ArmReadings

    def __init__(self, model: TabletopModel) -> None:
        self.observation = model.observation()
        self.action = model.action()
        self.control_step = model.control_step
        self.scenery = model.scenery()
        self._model = model

    def _read_columns(self, columns: Float[np.ndarray, "width time"]) -> Observed:
        """ξ in the order of `observation`; signals: `hand_position` [3, T] and `table_contact` [T].

        The rows are joint angles, each object's position and quaternion, the hand's position, table contact.
        """
        objects = len(self._model.cylinders)
        rows = [columns[: len(self.observation) - 9 * objects]]
        poses = columns[len(rows[0]) : -4].reshape(objects, 7, columns.shape[1])
        for pose in poses:
            rows += [pose[:3], first_two_axes(pose[3:].T)]
        return Observed(
            xi=np.concatenate(rows).astype(np.float32),
            signals={"hand_position": columns[-4:-1], "table_contact": columns[-1] != 0.0},
        )


class Tabletop(ArmScene):
    """The scene in PyBullet."""

    arm: Arm

    def __init__(self, model: TabletopModel) -> None:
        super().__init__(model)
        self._build()

    def _build(self) -> None:
        model = self._model
        self._world = World(time_step=model.control_step, solver_iterations=model.solver_iterations)
        self.arm = Arm(self._world, model.arm)
        self._apply = model.drive.bind(self.arm)
        self._layout = Struct(f"{len(model.arm.joints) + 7 * len(model.cylinders) + 4}d")
        self._cylinders = [
            Cylinder(self._world, radius=c.radius, height=c.height, position=c.start) for c in model.cylinders
        ]

    def reset(self, physics: Physics) -> None:
        """Arm at home, objects at their start, with the dynamics named in `physics`."""
        if not self._is_sane():
            self._world.close()
            self._build()
        for name, cylinder in zip(self._model.objects, self._cylinders, strict=True):
            cylinder.set_dynamics(
                mass=physics[f"{name}_mass"],
                friction=physics[f"{name}_friction"],
                rolling_friction=physics[f"{name}_rolling_friction"],
                restitution=physics[f"{name}_restitution"],
            )
        self._world.forget_contacts()
        self.arm.reset()
        for cylinder in self._cylinders:
            cylinder.reset()

    def _is_sane(self) -> bool:
        """Whether a reset is enough: a world that held NaN or threw a body far out does not recover."""
        return all(
            abs(number) < _FAR for number in (*self._layout.unpack(self.record()), *self.arm.state.speeds)
        )

    def step(self, command: Sequence[float]) -> Record:
        """Drive the joints for one control step."""
        self._apply(command)
        self._world.step()
        return self.record()

    def record(self) -> Record:
        """See `Record`; tuples are added and packed at once because this runs in every step."""
        state = self.arm.refresh()
        numbers = state.joints
        for cylinder in self._cylinders:
            position, orientation = cylinder.pose()
            numbers += position + orientation
        return self._layout.pack(*numbers, *state.position, self.arm.touches(self._world.plane))

    def observed(self, records: Sequence[Record]) -> Observed:
        """ξ in the order of `observation`; signals: `hand_position` [3, T] and `table_contact` [T]."""
        columns = np.frombuffer(b"".join(records)).reshape(len(records), -1).T
        return self._read_columns(columns)

    def close(self) -> None:
        """End the simulation."""
        self._world.close()


def first_two_axes(quaternion: Float[np.ndarray, "time 4"]) -> Float[np.ndarray, "6 time"]:
    """First two columns of the rotation matrices of quaternions (x, y, z, w): a continuous orientation."""
    x, y, z, w = quaternion.T
    return np.stack(
        [
            1 - 2 * (y * y + z * z),
            2 * (x * y + z * w),
            2 * (x * z - y * w),
            2 * (x * y - z * w),
            1 - 2 * (x * x + z * z),
            2 * (y * z + x * w),
        ]
    )
