"""Franka Emika pushing two wooden rolls with joint torques: `franka`, `-mujoco` and `-rehearsal`.

The robot is the `panda.urdf` that ships with PyBullet, with the true arm's joint limits, 1 N·m·s/rad of joint
damping, and fingers that touch nothing. There is no limit on joint speed, as in the paper's simulation.
"""

from dataclasses import replace
from functools import partial
from math import pi

from workers.controllers.end_effector import EndEffectorWaypoints, WaypointRanges
from workers.environments.drive import TorqueDrive
from workers.environments.tabletop import CylinderModel, Tabletop, TabletopModel
from workers.setups.engines import in_mujoco
from workers.setups.setup import Setup
from workers.simulation.arm import UNLIMITED, ArmModel
from workers.tasks.stable_push import StablePush

HORIZON = 500  # control steps (section 7 of the paper: 500 at 500 Hz)
CONTROL_STEP = 1 / 500  # s
TABLE_X = (0.0, 1.5)  # m
TABLE_Y = (-0.45, 0.45)  # m
ROLL = {"mass": 2.0, "friction": 0.3, "rolling_friction": 0.01, "restitution": 0.05}  # kg, then coefficients
STARTS = ((0.32, 0.15), (0.50, 0.15))  # m; the rolls are pushed towards -y
SUCCESS = 0.4  # m pushed in total, both upright
BROKEN = -0.5  # m: at least one of them fell

ARM = ArmModel(
    urdf="franka_panda/panda.urdf",
    joints=tuple(f"panda_joint{number}" for number in range(1, 8)),
    lower=(-0.5, 0.0, -0.5, -3.0718, -2.8973, -0.0175, -2.8973),
    upper=(0.5, 1.7628, 0.5, -0.0698, 2.8973, 3.7525, 2.8973),
    home=(0.4239, 0.0, 0.4799, -2.727, 0.2047, 2.4689, 1.5125),
    joint_damping=1.0,
    speed_limit=UNLIMITED,
    base=(0.0, 0.0, 0.0),
    hand="panda_hand_joint",
    fingers=("panda_finger_joint1", "panda_finger_joint2"),
    finger_force=20.0,
)
TORQUE_LIMITS = (87.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0)  # N·m, of the real arm

MODEL = TabletopModel(
    arm=ARM,
    drive=TorqueDrive(TORQUE_LIMITS),
    cylinders=tuple(CylinderModel(radius=0.08, height=0.22, start=start, nominal=ROLL) for start in STARTS),
    control_step=CONTROL_STEP,
    solver_iterations=10,
    table=(TABLE_X, TABLE_Y),
)

WAYPOINTS = WaypointRanges(
    position=((0.2, 0.6), TABLE_Y, (0.1, 0.25)),
    orientation=((pi - 0.5, pi + 0.5), (-0.5, 0.5), (-1.0, 1.0)),  # the palm points down, more or less
    stiffness=(50.0, 500.0),
    damping=(10.0, 50.0),
)


HOME = (0.2295, 0.2908, 0.2048, 3.0248, 0.2527, -0.0150)
"""The hand's pose at the home angles: m, then roll, pitch and yaw in rad."""
SPEED_LIMIT = 2.175
"""Joints 1 to 4 of the real arm reach this speed, in rad/s; the others may reach 2.61, but Bullet has one
limit for all."""


def franka() -> Setup:
    """The setup `franka`: 48-D, 500 steps of 2 ms, f in [-1.8, 1.2] m."""
    return _pushing("franka", MODEL)


def franka_mujoco() -> Setup:
    """The setup `franka` in another engine.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    return in_mujoco(franka(), MODEL)


def franka_rehearsal() -> Setup:
    """What stands in for a real Franka Emika: the simulation with limited joint speeds."""
    arm = replace(ARM, speed_limit=SPEED_LIMIT)
    return _pushing("franka-rehearsal", replace(MODEL, arm=arm))


def _pushing(name: str, model: TabletopModel) -> Setup:
    """The same under another name and with another model of the scene."""
    task = StablePush(
        starts=STARTS,
        direction=-1.0,
        table_x=TABLE_X,
        table_y=TABLE_Y,
        margin=0.05,
        channel=len(ARM.joints),
    )
    return Setup(
        name=name,
        build=partial(Tabletop, model),
        controller=EndEffectorWaypoints(
            waypoints=6,
            ranges=WAYPOINTS,
            turning=(1.0, 0.1),
            torque_limits=TORQUE_LIMITS,
            home=HOME,
            objects=STARTS,
        ),
        task=task,
        observation=model.observation(),
        horizon=HORIZON,
        control_step=CONTROL_STEP,
        physics=model.gaps()["training"],
        gaps=model.gaps(),
        objective_limits=task.objective_limits,
        success=SUCCESS,
        broken=BROKEN,
    )
