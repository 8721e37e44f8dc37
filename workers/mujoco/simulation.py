"""One compiled scene of MuJoCo: reset, advanced and recorded step by step, or for a whole episode."""

from collections.abc import Iterable, Sequence
from typing import Any

import mujoco
import numpy as np
from jaxtyping import Float

from workers.mujoco import episodes
from workers.mujoco.explosions import keep_exploded
from workers.plans import HandPlan, JointPlan, Plan

_QUATERNION = (1, 2, 3, 0)  # x, y, z, w of MuJoCo's w, x, y, z


class Simulation:
    """A scene in motion.

    MuJoCo's step has two halves: forces and motion, then all that follows from the new state. A step here is
    the second half of MuJoCo's and the first of the next, so that what is read is up to date.

    Args:
        model: the compiled scene.
        joints: names of the hinges whose angles are recorded.
        poses: names of the free joints whose poses are.
        with_speeds: names of the hinges whose speeds are.
        point: name of the body whose origin is; "" for none.
        substeps: of MuJoCo, in each step.
    """

    def __init__(
        self,
        model: Any,
        *,
        joints: Sequence[str],
        poses: Sequence[str],
        with_speeds: Sequence[str] = (),
        point: str = "",
        substeps: int = 1,
    ) -> None:
        keep_exploded(model)
        self.model = model
        self.data = mujoco.MjData(model)
        self.substeps = substeps
        self.keep = 1.0
        """Each MuJoCo step ends with this share of every velocity."""
        self._point = model.body(point).id if point else 0
        angles = [int(model.joint(name).qposadr[0]) for name in joints]
        starts = [int(model.joint(name).qposadr[0]) for name in poses]
        order = (0, 1, 2, *(3 + place for place in _QUATERNION))
        places = [*angles, *(start + offset for start in starts for offset in order)]
        rates = [int(model.joint(name).dofadr[0]) for name in with_speeds]
        self._watched = (
            self.data.qpos,
            self.data.qvel,
            self.data.xpos[self._point] if point else np.empty(0),
            self.data.sensordata,
            np.array(places, dtype=np.int64),
            np.array(rates, dtype=np.int64),
        )
        self.width = len(places) + len(rates) + len(self._watched[2]) + 1

    def reset(self, angles: Iterable[tuple[str, float]]) -> None:
        """Bring everything back to where the scene puts it, at rest, with nothing left of earlier steps.

        Args:
            angles: of hinges that start elsewhere, in rad, by name.
        """
        model, data = self.model, self.data
        mujoco.mj_setConst(model, data)  # what follows from masses
        mujoco.mj_resetData(model, data)
        for name, angle in angles:
            data.joint(name).qpos[0] = angle
        mujoco.mj_step1(model, data)

    def step(self, command: Sequence[float]) -> None:
        """Advance one step.

        Args:
            command: one number per motor.
        """
        model, data = self.model, self.data
        data.ctrl[:] = command
        for _ in range(self.substeps):
            mujoco.mj_step2(model, data)
            data.qvel *= self.keep
            mujoco.mj_step1(model, data)

    def record(self) -> Float[np.ndarray, " width"]:
        """What is seen now.

        Returns:
            Angles of `joints`, position and quaternion (x, y, z, w) of each of `poses`, the speeds, the
            point, and 1 or 0: whether a touch sensor felt the ground in the last step.
        """
        qpos, qvel, point, sensors, places, rates = self._watched
        return np.concatenate([qpos[places], qvel[rates], point, [float(sensors.any())]])

    def run(self, plan: Plan, steps: int) -> Float[np.ndarray, "steps width"]:
        """Follow the first steps of a plan, in compiled code.

        Args:
            plan: of the joints that the motors move; or of a hand, which is the `point`, of an arm whose
                joints come first among the scene's.
            steps: how many, at most all that it has.

        Returns:
            The record of each step.
        """
        rows, records = plan.rows[:steps], np.empty((steps, self.width))
        scene = (self.model._address, self.data._address, self.data.ctrl, self.substeps, self.keep)
        if isinstance(plan, JointPlan):
            moved = self.model.jnt_qposadr[self.model.actuator_trnid[:, 0]].astype(np.int64)
            limits = np.array(plan.lower), np.array(plan.upper)
            episodes.run_joints(scene, rows, limits, moved, self._watched, records)
        else:
            self._run_hand(scene, rows, plan, records)
        return records

    def _run_hand(self, scene: episodes.Scene, rows: np.ndarray, plan: HandPlan, records: np.ndarray) -> None:
        data, dofs = self.data, self.model.nv
        episodes.run_hand(
            scene,
            rows,
            plan.turning,
            np.array(plan.torque_limits),
            self._point,
            (data.xpos[self._point], data.xquat[self._point], data.qfrc_bias),
            (np.empty((3, dofs)), np.empty((3, dofs)), np.empty(6)),
            self._watched,
            records,
        )
