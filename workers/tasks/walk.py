"""Walk forward along a narrow walkway without harming the robot (section 6 of the paper)."""

from dataclasses import dataclass, field
from math import radians

import numpy as np
from jaxtyping import Bool

from workers.environments.environment import Observed
from workers.tasks.task import Bad, Task


@dataclass(frozen=True)
class Walk(Task):
    """f = 10 · y_T − N, N the steps with a joint faster than `speed`.

    The observation must offer the signals `joint_speeds` [joints, T] and `elbow_contact` [T].

    Attributes:
        channel: index in ξ of the body's x; y, z and two columns of its rotation matrix follow.
        speed: greatest joint speed that does no harm, in rad/s.
        tilt: greatest roll and pitch, in rad.
        height: lowest and highest the body may be, in m.
        corridor: half the width of the walkway, in m.
    """

    channel: int
    speed: float = 10.0
    tilt: float = radians(60)
    height: tuple[float, float] = (0.1, 0.7)
    corridor: float = 0.5
    conditions: tuple[str, ...] = field(
        default=("joint_speed", "tilt", "elbow_contact", "height", "corridor"), init=False
    )

    def __post_init__(self) -> None:
        """Refuse heights in the wrong order."""
        if not self.height[0] < self.height[1]:
            raise ValueError(f"height must be (low, high) with low < high, got {self.height}")

    def is_bad(self, observed: Observed) -> Bool[np.ndarray, "conditions time"]:
        """Rows as in `conditions`."""
        body = observed.xi[self.channel : self.channel + 9]
        x, _, z = body[:3]
        roll, pitch = roll_and_pitch(body[3:])
        low, high = self.height
        return np.stack(
            [
                np.abs(observed.signals["joint_speeds"]).max(axis=0) > self.speed,
                (np.abs(roll) > self.tilt) | (np.abs(pitch) > self.tilt),
                observed.signals["elbow_contact"],
                (z < low) | (z > high),
                np.abs(x) > self.corridor,
            ]
        )

    def clearance(self, observed: Observed) -> float:
        """Measure how near the body came to the borders of the walkway, and to its lowest and highest.

        Args:
            observed: all steps of the episode.

        Returns:
            The least distance inside all of them, in m; negative outside.
        """
        x, _, z = observed.xi[self.channel : self.channel + 3]
        low, high = self.height
        return float(np.min([self.corridor - np.abs(x), z - low, high - z]))

    def objective(self, observed: Observed, bad: Bad) -> float:
        """Value a walk towards +y.

        Args:
            observed: all steps of the episode.
            bad: rows as in `conditions`; only the first counts.

        Returns:
            Ten times the metres walked, less one for each step with a fast joint.
        """
        return 10.0 * float(observed.xi[self.channel + 1, -1]) - float(np.count_nonzero(bad[0]))


def roll_and_pitch(axes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Roll and pitch in rad, about the fixed axes, from the first two columns [6, T] of rotation matrices."""
    first_x, first_y, first_z, second_x, second_y, second_z = axes
    return (
        np.arctan2(second_z, first_x * second_y - first_y * second_x),
        np.arcsin(np.clip(-first_z, -1.0, 1.0)),
    )
