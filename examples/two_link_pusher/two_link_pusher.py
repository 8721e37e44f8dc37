"""A robot of one's own: a planar arm of two links pushes a puck to the left, towards +y.

From this folder: svaedc collect --setup two_link_pusher --episodes 400 --dataset data
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from workers.controllers.controller import Command, Controller
from workers.environments.environment import Channel, Environment, Observed
from workers.physics import Physics, PhysicsRanges, around
from workers.setups import Setup
from workers.simulation.bullet import pybullet
from workers.simulation.cylinder import Cylinder
from workers.simulation.description import joint_indices, load_robot
from workers.simulation.sketch import Canvas, Sketch, State
from workers.simulation.world import World
from workers.tasks.task import Task

URDF = Path(__file__).with_name("two_link_pusher.urdf")
JOINTS = ("shoulder", "elbow")
HOME = (-1.0, 0.6)  # rad
EFFORT = 5.0  # N·m of each motor
SPEED = 2.0  # rad/s, the fastest command
LINK = 0.25  # m, each of two
REACH = 2 * LINK
PUCK = (0.38, 0.0)  # m, where it stands at first
PUCK_RADIUS = 0.04  # m
NOMINAL = {"puck_mass": 0.2, "puck_friction": 0.4}  # kg, and a coefficient
CONTROL_STEP = 0.01  # s
SUBSTEPS = 2
HORIZON = 200  # control steps
SEGMENTS = 4

OBSERVATION = (
    *(Channel(name, "rad", -3.0, 3.0) for name in JOINTS),
    *(Channel(name, "m", -3.0, 3.0) for name in ("puck_x", "puck_y")),
)
ACTION = tuple(Channel(name, "rad/s", -SPEED, SPEED) for name in JOINTS)


def draw(canvas: Canvas, state: State) -> None:
    """From above: how far the arm reaches, the puck, and both links."""
    canvas.circle((0.0, 0.0), radius=REACH, color="gainsboro")
    canvas.circle((state["puck_x"], state["puck_y"]), radius=PUCK_RADIUS, color="peru")
    angles = np.cumsum([state[name] for name in JOINTS])
    ends = np.cumsum(LINK * np.stack([np.cos(angles), np.sin(angles)], axis=1), axis=0)
    canvas.line([(0.0, 0.0), *ends], width=0.03, color="steelblue")
    canvas.circle((0.0, 0.0), radius=0.03, color="navy")


class Pusher(Environment):
    """The arm and its puck on the plane z = 0; a command is the speed of both joints."""

    observation = OBSERVATION
    action = ACTION
    control_step = CONTROL_STEP
    scenery = Sketch(draw, x=(-0.6, 0.7), y=(-0.6, 0.6))

    def __init__(self) -> None:
        self._world = World(time_step=CONTROL_STEP / SUBSTEPS, solver_iterations=20)
        self._client = self._world.client
        self._arm = load_robot(URDF, self._client, useFixedBase=True)
        index = joint_indices(self._arm, self._client, URDF, JOINTS)
        self._joints = [index[name] for name in JOINTS]
        self._puck = Cylinder(self._world, radius=PUCK_RADIUS, height=0.06, position=PUCK)

    def reset(self, physics: Physics) -> None:
        """Everything back to its start, and old contacts forgotten: no episode depends on those before."""
        self._puck.set_dynamics(
            mass=physics["puck_mass"],
            friction=physics["puck_friction"],
            rolling_friction=0.0,
            restitution=0.0,
        )
        self._world.forget_contacts()
        for joint, angle in zip(self._joints, HOME, strict=True):
            pybullet.resetJointState(self._arm, joint, angle, 0.0, physicsClientId=self._client)
        self._puck.reset()
        self._drive((0.0, 0.0))

    def step(self, command: Sequence[float]) -> tuple[float, ...]:
        """Seek the joint speeds for one control step."""
        self._drive(command)
        for _ in range(SUBSTEPS):
            self._world.step()
        return self.record()

    def record(self) -> tuple[float, ...]:
        """The angles of the joints, and where the puck is."""
        states = pybullet.getJointStates(self._arm, self._joints, physicsClientId=self._client)
        (x, y, _), _ = self._puck.pose()
        return (*(state[0] for state in states), x, y)

    def observed(self, records: Sequence[tuple[float, ...]]) -> Observed:
        """Here everything that is seen is in ξ."""
        return Observed(xi=np.array(records, dtype=np.float32).T, signals={})

    def close(self) -> None:
        """End the simulation."""
        self._world.close()

    def _drive(self, speeds: Sequence[float]) -> None:
        pybullet.setJointMotorControlArray(
            self._arm,
            self._joints,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=speeds,
            forces=(EFFORT,) * len(JOINTS),
            physicsClientId=self._client,
        )


class Segments(Controller):
    """The episode in equal parts, each with a speed of its own for every joint."""

    parameters = tuple(
        Channel(f"{joint}_{segment}", "rad/s", -SPEED, SPEED)
        for segment in range(1, SEGMENTS + 1)
        for joint in JOINTS
    )

    def start(self, x: np.ndarray, environment: Any, horizon: int) -> Command:  # noqa: ARG002
        """Plans at once: it needs no feedback."""
        speeds = self.values(x).reshape(SEGMENTS, len(JOINTS)).tolist()
        return lambda step: speeds[step * SEGMENTS // horizon]


class PushLeft(Task):
    """f = how far the puck moved towards +y, in m, at most 0.5 either way."""

    conditions = ("puck_out_of_reach", "joint_at_its_limit")

    def is_bad(self, observed: Observed) -> np.ndarray:
        """One row per condition."""
        shoulder, elbow, x, y = observed.xi
        return np.stack([np.hypot(x, y) > REACH, np.maximum(abs(shoulder), abs(elbow)) > 2.4])

    def objective(self, observed: Observed, bad: np.ndarray) -> float:  # noqa: ARG002
        """The puck's y at the end, less that at the start."""
        return float(np.clip(observed.xi[3, -1] - PUCK[1], -0.5, 0.5))


def setup() -> Setup:
    """What `--setup two_link_pusher` loads."""
    training = around(NOMINAL, 0.2)
    fixed = {name: (value, value) for name, value in NOMINAL.items()}
    return Setup(
        name="two_link_pusher",
        build=Pusher,
        controller=Segments(),
        task=PushLeft(),
        observation=OBSERVATION,
        horizon=HORIZON,
        control_step=CONTROL_STEP,
        physics=training,
        gaps={
            "paper": PhysicsRanges(fixed | {"puck_friction": training.intervals["puck_friction"]}),
            "training": training,
            "wide": around(NOMINAL, 0.5),
        },
        objective_limits=(-0.5, 0.5),
        success=0.15,
    )
