"""Daisy on flat ground, walking towards +y: what all its setups share."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product
from struct import Struct

import numpy as np
from jaxtyping import Float

from workers.environments import daisy_body
from workers.environments.daisy_body import JOINTS, KINDS, LEGS, SIDES
from workers.environments.environment import Channel, Environment, Observed
from workers.environments.tabletop import first_two_axes
from workers.physics import Physics
from workers.simulation.hexapod import Hexapod, HexapodModel
from workers.simulation.scenery import Camera, Ground, Machine, Scenery
from workers.simulation.world import World

SUBSTEPS = 4
CONTROL_STEP = 1 / 60  # s
SOLVER_ITERATIONS = 20
BODY = len(JOINTS)  # index in ξ of the body's x
HOME = tuple(angle for side in SIDES[:: len(KINDS)] for angle in (0.0, 0.0, -side * 1.57))  # rad
UNLIMITED = (math.inf,) * len(KINDS)
TRUE_SPEEDS = tuple(daisy_body.SPEED.values())
WALKWAY = 0.5  # m to either side, as pictures show it
NOMINAL = {"friction": 2.0, "restitution": 0.05, "link_damping": 0.1}  # the last in 1/s

ROBOT = HexapodModel(
    urdf=daisy_body.urdf(),
    joints=JOINTS,
    feet=tuple(f"{leg}_elbow" for leg in LEGS),
    home=HOME,
    height=0.305,
    center=daisy_body.body().center,
    torques=tuple(daisy_body.TORQUE.values()) * len(LEGS),
    speeds=UNLIMITED * len(LEGS),
    stiffness=0.1,
    damping=1.0,
)

SCENERY = Scenery(
    bodies=(Machine(ROBOT.urdf, JOINTS, "body"),),
    ground=Ground(0.5, (-WALKWAY, WALKWAY), (-math.inf, math.inf), numbered=(WALKWAY,)),
    camera=Camera(target=(0.0, 0.0, 0.22), follows="body", distance=2.8, yaw=40.0, pitch=-32.0, angle=38.0),
)


@dataclass(frozen=True)
class DaisyModel:
    """What tells one Daisy from another.

    Attributes:
        speeds: greatest of the motors of base, shoulder and elbow, in rad/s; all infinite for no limit.
        reach: greatest commanded angle of base, shoulder and elbow, in rad.
    """

    speeds: tuple[float, ...]
    reach: tuple[float, float, float]

    def action(self) -> tuple[Channel, ...]:
        """Wanted joint angles in rad."""
        rows = zip(JOINTS, self.reach * len(LEGS), strict=True)
        return tuple(Channel(name, "rad", -limit, limit) for name, limit in rows)


def observation() -> tuple[Channel, ...]:
    """Joint angles (rad), position of the body (m), two columns of its rotation matrix."""
    slack = 0.5  # rad; hard landings push joints past their limits
    limit = daisy_body.LIMIT + slack
    joints = [Channel(name, "rad", -limit, limit) for name in JOINTS]
    position = [Channel("body_x", "m", -15.0, 15.0), Channel("body_y", "m", -15.0, 15.0)]
    position.append(Channel("body_z", "m", -0.5, 3.0))
    columns = product(("first", "second"), "xyz")
    axes = [Channel(f"body_{column}_axis_{axis}", "1", -1.0, 1.0) for column, axis in columns]
    return (*joints, *position, *axes)


_FAR = 1e3  # m, rad and rad/s

Record = bytes
"""It packs doubles: joint angles, joint speeds, centre of mass, quaternion, elbow contact (0 or 1)."""

_LAYOUT = Struct(f"{2 * len(JOINTS) + 8}d")


class Daisy(Environment):
    """Daisy on the plane z = 0, its motors aiming at the commanded joint angles."""

    control_step = CONTROL_STEP
    scenery = SCENERY

    def __init__(self, model: DaisyModel) -> None:
        self.observation = observation()
        self.action = model.action()
        self._robot_model = replace(ROBOT, speeds=model.speeds * len(LEGS))
        self._build()

    def _build(self) -> None:
        self._world = World(time_step=CONTROL_STEP / SUBSTEPS, solver_iterations=SOLVER_ITERATIONS)
        self.robot = Hexapod(self._world, self._robot_model)

    def reset(self, physics: Physics) -> None:
        """The robot at home, 5 mm above the height at which it stands, with the dynamics of `physics`."""
        if not all(abs(number) < _FAR for number in _LAYOUT.unpack(self.record())):
            self._world.close()  # a world that held NaN or threw the robot far out does not recover
            self._build()
        self.robot.set_dynamics(
            friction=physics["friction"],
            restitution=physics["restitution"],
            damping=physics["link_damping"],
        )
        self._world.forget_contacts()
        self.robot.reset()

    def step(self, command: Sequence[float]) -> Record:
        """Aim at the joint angles for one control step."""
        self.robot.drive(command)
        step = self._world.step
        for _ in range(SUBSTEPS):
            step()
        return self.record()

    def record(self) -> Record:
        """See `Record`; packed at once because floats kept alive would slow the simulator down."""
        angles, speeds = self.robot.joints()
        position, orientation = self.robot.pose()
        return _LAYOUT.pack(*angles, *speeds, *position, *orientation, self.robot.scrapes())

    def observed(self, records: Sequence[Record]) -> Observed:
        """ξ in the order of `observation`; signals: `joint_speeds` [18, T] and `elbow_contact` [T]."""
        columns = np.frombuffer(b"".join(records)).reshape(len(records), -1).T
        angles, speeds = columns[:BODY], columns[BODY : 2 * BODY]
        center, quaternion, contact = columns[2 * BODY : -5], columns[-5:-1], columns[-1]
        axes = first_two_axes(quaternion.T)
        origin = center - _rotate(axes, self._robot_model.center)
        return Observed(
            xi=np.concatenate([angles, origin, axes]).astype(np.float32),
            signals={"joint_speeds": speeds, "elbow_contact": contact != 0.0},
        )

    def close(self) -> None:
        """End the simulation."""
        self._world.close()


def _rotate(
    axes: Float[np.ndarray, "6 time"], vector: tuple[float, float, float]
) -> Float[np.ndarray, "3 time"]:
    """The vector under the rotations whose first two columns are given."""
    first, second = axes[:3], axes[3:]
    third = np.cross(first, second, axis=0)
    x, y, z = vector
    return x * first + y * second + z * third
