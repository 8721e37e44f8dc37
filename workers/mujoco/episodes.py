"""Whole episodes in compiled code: the same calls and the same arithmetic as one step after the other.

Numba compiles these functions when they are first called, and keeps the result on disk: no compiler need be
installed. They call MuJoCo's public C functions by name.
"""

from pathlib import Path
from typing import Any, no_type_check

import llvmlite.binding
import mujoco
import numba
import numpy as np

_XBODY = 2  # mjOBJ_XBODY: a body's own frame
_types = numba.types
_ADDRESS, _INT = _types.intp, _types.int32

llvmlite.binding.load_library_permanently(str(next(Path(mujoco.__file__).parent.glob("libmujoco.*"))))


def _function(name: str, *arguments: Any) -> Any:
    return _types.ExternalFunction(name, _types.void(*arguments))


_step1 = _function("mj_step1", _ADDRESS, _ADDRESS)
_step2 = _function("mj_step2", _ADDRESS, _ADDRESS)
_jacobian = _function("mj_jacBody", _ADDRESS, _ADDRESS, _ADDRESS, _ADDRESS, _INT)
_velocity = _function("mj_objectVelocity", _ADDRESS, _ADDRESS, _INT, _INT, _ADDRESS, _INT)

_compile = numba.njit(cache=True, error_model="numpy")


Scene = tuple[int, int, np.ndarray, int, float]
"""It has the addresses of mjModel and mjData, the data's ctrl, MuJoCo's steps in each step, and the share of
every velocity that each of them ends with."""


@_compile
@no_type_check
def _advance(scene: Scene, qvel: np.ndarray) -> None:
    model, data, _, substeps, keep = scene
    for _ in range(substeps):
        _step2(model, data)
        for dof in range(len(qvel)):
            qvel[dof] *= keep
        _step1(model, data)


@_compile
@no_type_check
def _record(watched: tuple[np.ndarray, ...], record: np.ndarray) -> None:
    qpos, qvel, point, sensors, places, rates = watched
    column = 0
    for place in places:
        record[column] = qpos[place]
        column += 1
    for rate in rates:
        record[column] = qvel[rate]
        column += 1
    for number in point:
        record[column] = number
        column += 1
    record[column] = 1.0 if sensors.any() else 0.0


@_compile
@no_type_check
def run_joints(
    scene: Scene,
    rows: np.ndarray,
    limits: tuple[np.ndarray, np.ndarray],
    moved: np.ndarray,
    watched: tuple[np.ndarray, ...],
    records: np.ndarray,
) -> None:
    """Run the rows of a `JointPlan`: 0 for every command that leads a joint further beyond its limit.

    Args:
        scene: that is advanced.
        rows: commands, [T, joints].
        limits: positions of each joint at which it is still commanded downwards, and upwards.
        moved: place of each joint in qpos.
        watched: what `Simulation.record` reads.
        records: they are written here, [T, width].
    """
    ctrl, qpos, qvel = scene[2], watched[0], watched[1]
    lower, upper = limits
    for step in range(len(rows)):
        for joint in range(len(ctrl)):
            command, angle = rows[step, joint], qpos[moved[joint]]
            stays = (command > 0.0 and angle >= upper[joint]) or (command < 0.0 and angle <= lower[joint])
            ctrl[joint] = 0.0 if stays else command
        _advance(scene, qvel)
        _record(watched, records[step])


@_compile
@no_type_check
def run_hand(
    scene: Scene,
    rows: np.ndarray,
    turning: tuple[float, float],
    limits: np.ndarray,
    hand: int,
    state: tuple[np.ndarray, ...],
    scratch: tuple[np.ndarray, ...],
    watched: tuple[np.ndarray, ...],
    records: np.ndarray,
) -> None:
    """Run the rows of a `HandPlan`, as `workers.controllers.end_effector` commands it.

    torque = Jᵀ [kp (p* − p) + kd (ṗ* − ṗ) + p̈*; Kp e(R*, R) + Kd (ω* − ω)] + gravity, clipped to the limits.

    Args:
        scene: that is advanced.
        rows: of the plan, [T, 18].
        turning: Kp and Kd.
        limits: greatest torque of each joint, in N·m.
        hand: index of its body.
        state: position and quaternion (w, x, y, z) of the hand, and the torques against gravity, Coriolis
            and centrifugal forces.
        scratch: room for the linear and angular Jacobians, [3, dofs], and the velocity, [6], angular first.
        watched: what `Simulation.record` reads.
        records: they are written here, [T, width].
    """
    model, data, ctrl, _, _ = scene
    position, quaternion, gravity = state
    linear, angular, velocity = scratch
    force, moment = np.empty(3), np.empty(3)
    for step in range(len(rows)):
        row = rows[step]
        _jacobian(model, data, linear.ctypes.data, angular.ctypes.data, hand)
        _velocity(model, data, _XBODY, hand, velocity.ctypes.data, 0)
        kp, kd = row[16], row[17]
        for k in range(3):
            force[k] = kp * (row[k] - position[k]) + kd * (row[3 + k] - velocity[3 + k]) + row[6 + k]
        _moment(row, turning, quaternion, velocity, moment)
        for joint in range(len(ctrl)):
            torque = (
                linear[0, joint] * force[0]
                + linear[1, joint] * force[1]
                + linear[2, joint] * force[2]
                + angular[0, joint] * moment[0]
                + angular[1, joint] * moment[1]
                + angular[2, joint] * moment[2]
                + gravity[joint]
            )
            limit = limits[joint]
            ctrl[joint] = limit if torque > limit else -limit if torque < -limit else torque
        _advance(scene, watched[1])
        _record(watched, records[step])


@_compile
@no_type_check
def _moment(
    row: np.ndarray,
    turning: tuple[float, float],
    quaternion: np.ndarray,
    spin: np.ndarray,
    moment: np.ndarray,
) -> None:
    """Kp e + Kd (ω* − ω), in N·m; e = 2 sin(θ/2) · axis of the rotation still to be made."""
    kp, kd = turning
    a, b, c, d = row[9], row[10], row[11], row[12]
    w, x, y, z = quaternion[0], quaternion[1], quaternion[2], quaternion[3]
    stiffness = 2.0 * kp if a * x + b * y + c * z + d * w >= 0.0 else -2.0 * kp
    moment[0] = stiffness * (w * a - x * d - b * z + c * y) + kd * (row[13] - spin[0])
    moment[1] = stiffness * (w * b - y * d - c * x + a * z) + kd * (row[14] - spin[1])
    moment[2] = stiffness * (w * c - z * d - a * y + b * x) + kd * (row[15] - spin[2])
