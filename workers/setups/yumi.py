"""ABB YuMi pushing two paper towel rolls with joint speeds: `yumi`, `yumi-mujoco` and `yumi-rehearsal`.

The robot is a description of our own, `urdf/yumi.urdf`. Its right arm moves; the left one is a picture.
"""

from dataclasses import replace
from functools import partial
from pathlib import Path

from workers.controllers.joint_speed import JointSpeedWaypoints
from workers.environments.drive import SpeedDrive
from workers.environments.tabletop import CylinderModel, Tabletop, TabletopModel
from workers.setups.engines import in_mujoco
from workers.setups.setup import Setup
from workers.simulation.arm import UNLIMITED, ArmModel
from workers.tasks.stable_push import StablePush
from workers.tasks.stop import HandGuard

HORIZON = 1000  # control steps (section 7 of the paper: 1000 at 500 Hz)
CONTROL_STEP = 1 / 500  # s
TABLE_X = (0.15, 0.77)  # m
TABLE_Y = (-0.475, 0.475)  # m
MARGIN = 0.05  # m that the hand may leave the table
ROLL = {"mass": 0.15, "friction": 0.3, "rolling_friction": 0.01, "restitution": 0.05}  # kg, then coefficients
STARTS = ((0.31, -0.30), (0.43, -0.30))  # m; the rolls are pushed towards +y
SUCCESS = 0.4  # m pushed in total, both upright
BROKEN = -0.5  # m: at least one of them fell

ARM = ArmModel(
    urdf=str(Path(__file__).parents[1] / "environments" / "urdf" / "yumi.urdf"),
    joints=tuple(f"yumi_joint_{number}_r" for number in (1, 2, 7, 3, 4, 5, 6)),  # shoulder to wrist
    lower=(-2.9409, -2.5045, -2.9409, -2.1555, -5.0615, -1.5359, -3.9968),
    upper=(2.9409, 0.7592, 2.9409, 1.3963, 5.0615, 2.4086, 3.9968),
    home=(0.83101, -1.5, -1.2019, -0.1817, -2.1447, -0.7756, 3.572),
    joint_damping=0.5,
    speed_limit=UNLIMITED,
    base=(0.0, 0.0, -0.08),
    hand="yumi_joint_6_r",
    fingers=(),
    finger_force=0.0,
)
JOINT_SPEEDS = (3.1416, 3.1416, 3.1416, 3.1416, 6.9813, 6.9813, 6.9813)  # rad/s, of the real arm
MOTOR_FORCE = 30.0  # N·m; with more, a roll that the arm presses onto the table sinks into it
# Angles, in rad, beyond which no joint is driven. The last joint starts above its own and can only come in.
LOWER = (0.8, -1.5, -2.353, -1.724, -4.049, -1.229, -3.197)
UPPER = (2.353, 0.607, 1.0, 0.6, 4.049, 1.927, 3.197)


SHARE = 0.5
"""The simulation uses this share of the arm's joint speeds."""
REHEARSAL_SHARE = 0.2
"""The stand-in has this share of the arm's joint speeds, a reading of the paper's "1/5". The authors' code
notes 0.1 for the robot, at which next to nothing is pushed (docs/results/yumi.md)."""
LOWEST_HAND = 0.09
"""The hand's frame must stay so many metres above the table; lower, the gripper is about to hit it."""


def yumi() -> Setup:
    """The setup `yumi`: 48-D, 1000 steps of 2 ms, f in [-1.9, 1.55] m."""
    return _pushing("yumi", SHARE)


def yumi_mujoco() -> Setup:
    """The setup `yumi` in another engine.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    return in_mujoco(yumi(), _scene(SHARE))


def yumi_rehearsal() -> Setup:
    """What stands in for a real ABB YuMi: slower than the simulation, and stopped early with f = -1.9 m."""
    x, y = ((low - MARGIN, high + MARGIN) for low, high in (TABLE_X, TABLE_Y))
    return replace(_pushing("yumi-rehearsal", REHEARSAL_SHARE), stop=HandGuard(x=x, y=y, lowest=LOWEST_HAND))


def _pushing(name: str, share: float) -> Setup:
    """The same with joint speeds up to another share of the arm's own."""
    model = _scene(share)
    task = StablePush(
        starts=STARTS, direction=1.0, table_x=TABLE_X, table_y=TABLE_Y, margin=MARGIN, channel=len(ARM.joints)
    )
    return Setup(
        name=name,
        build=partial(Tabletop, model),
        controller=JointSpeedWaypoints(
            waypoints=6, joints=ARM.joints, speed_limits=model.drive.limits, lower=LOWER, upper=UPPER
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


def _scene(share: float) -> TabletopModel:
    """The model of the scene, with joint speeds up to a share of the arm's own."""
    speeds = tuple(share * speed for speed in JOINT_SPEEDS)
    return TabletopModel(
        arm=ARM,
        drive=SpeedDrive(speeds, MOTOR_FORCE),
        cylinders=tuple(CylinderModel(radius=0.05, height=0.22, start=at, nominal=ROLL) for at in STARTS),
        control_step=CONTROL_STEP,
        solver_iterations=50,
        table=(TABLE_X, TABLE_Y),
    )
