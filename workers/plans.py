"""Plans: what a controller wants of every step, before the world answers.

An environment that can execute a plan by itself does so in compiled code; every other one is commanded step
by step, with the same result.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True)
class JointPlan:
    """Commands that are known beforehand, but for joints that are at a limit: no command leads them further.

    Attributes:
        rows: the command of every step, [T, joints].
        lower: position of each joint at which it is still commanded downwards; −∞ for no limit.
        upper: the same upwards; ∞ for no limit.
    """

    rows: Float[np.ndarray, "time joints"]
    lower: tuple[float, ...]
    upper: tuple[float, ...]


@dataclass(frozen=True)
class HandPlan:
    """Where an arm's hand should be; joint torques lead it there by the transposed Jacobian.

    Attributes:
        rows: of every step, [T, 18]: wanted position (m), velocity (m/s) and acceleration (m/s²), orientation
            (quaternion x, y, z, w) and angular velocity (rad/s), kp (N/m) and kd (N·s/m) of the position.
        turning: kp in N·m/rad and kd in N·m·s/rad of the orientation.
        torque_limits: N·m of each joint.
    """

    rows: Float[np.ndarray, "time 18"]
    turning: tuple[float, float]
    torque_limits: tuple[float, ...]


Plan = JointPlan | HandPlan


class PlannedCommand:
    """The command of each step, and the plan that it follows.

    Args:
        command: from the index of a step to its command; it may read the robot as it is then.
        plan: that it follows.
    """

    __slots__ = ("_command", "plan")

    def __init__(self, command: Callable[[int], Sequence[float]], plan: Plan) -> None:
        self._command = command
        self.plan = plan

    def __call__(self, step: int) -> Sequence[float]:
        """The command of a step."""
        return self._command(step)
