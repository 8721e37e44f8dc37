"""Push tall objects across a table without tipping them over (section 7 of the paper)."""

from dataclasses import dataclass, field
from math import cos, radians

import numpy as np
from jaxtyping import Bool, Float32

from workers.environments.environment import Observed
from workers.tasks.task import Bad, Task

TIPPED_COSINE = cos(radians(30))  # between an object's axis and the vertical


@dataclass(frozen=True)
class StablePush(Task):
    """f = Σ over objects of direction · (y_T − y_0) when it ends upright, −y_max when it does not.

    Attributes:
        starts: (x, y) of each object at reset, in m; y_0 above.
        direction: +1 to push towards +y, −1 towards −y.
        table_x: the table's extent along x, in m.
        table_y: the table's extent along y, in m; y_max is its width.
        margin: how far outside the table the hand may go, in m.
        channel: index of the first object's x in ξ; 9 channels per object.
    """

    starts: tuple[tuple[float, float], ...]
    direction: float
    table_x: tuple[float, float]
    table_y: tuple[float, float]
    margin: float
    channel: int
    conditions: tuple[str, ...] = field(
        default=("object_tipped", "object_off_table", "hand_outside_workspace", "arm_touches_table"),
        init=False,
    )

    def __post_init__(self) -> None:
        """Refuse a direction that is neither way."""
        if self.direction not in (-1.0, 1.0):
            raise ValueError(f"direction must be +1 or -1, got {self.direction}")

    @property
    def objective_limits(self) -> tuple[float, float]:
        """The value of f when every object tips over, and when every one ends upright at the far edge."""
        far = [abs((self.table_y[1] if self.direction > 0 else self.table_y[0]) - y) for _, y in self.starts]
        return -len(self.starts) * (self.table_y[1] - self.table_y[0]), sum(far)

    def is_bad(self, observed: Observed) -> Bool[np.ndarray, "conditions time"]:
        """Rows: an object tipped (> 30°), an object off the table, the hand outside, the arm on the table."""
        objects = [self._object(observed, number) for number in range(len(self.starts))]
        hand = observed.signals["hand_position"]
        return np.stack(
            [
                np.any([_has_tipped(each) for each in objects], axis=0),
                np.any([~self._on_table(each[0], each[1], 0.0) for each in objects], axis=0),
                ~self._on_table(hand[0], hand[1], self.margin),
                observed.signals["table_contact"],
            ]
        )

    def objective(self, observed: Observed, bad: Bad) -> float:  # noqa: ARG002
        """Value a push; an object pushed off the table counts as tipped, since it would fall.

        Args:
            observed: all steps of the episode.
            bad: not looked at.

        Returns:
            f, in m.
        """
        y_max = self.table_y[1] - self.table_y[0]
        total = 0.0
        for number, (_, y_start) in enumerate(self.starts):
            last = self._object(observed, number)[:, -1:]
            fallen = _has_tipped(last)[0] or not self._on_table(last[0], last[1], 0.0)[0]
            total += -y_max if fallen else self.direction * (float(last[1, 0]) - y_start)
        return total

    def stopped_objective(self, observed: Observed, bad: Bad) -> float:  # noqa: ARG002
        """Value a stopped push as if every object had fallen.

        Args:
            observed: not looked at.
            bad: not looked at.

        Returns:
            −y_max for every object, in m (section 7 of the paper: −2 y_max).
        """
        return self.objective_limits[0]

    def clearance(self, observed: Observed) -> float:
        """Measure how near the hand came to the border of its workspace.

        Args:
            observed: all steps of the episode.

        Returns:
            The least distance inside that border along x and y, in m; negative outside it.
        """
        x, y, *_ = observed.signals["hand_position"]
        sides = [x - self.table_x[0], self.table_x[1] - x, y - self.table_y[0], self.table_y[1] - y]
        return float(np.min(sides) + self.margin)

    def _object(self, observed: Observed, number: int) -> Float32[np.ndarray, "9 time"]:
        begin = self.channel + 9 * number
        return observed.xi[begin : begin + 9]

    def _on_table(self, x: np.ndarray, y: np.ndarray, margin: float) -> np.ndarray:
        (x_low, x_high), (y_low, y_high) = self.table_x, self.table_y
        return (x_low - margin <= x) & (x <= x_high + margin) & (y_low - margin <= y) & (y <= y_high + margin)


def _has_tipped(pose: Float32[np.ndarray, "9 time"]) -> Bool[np.ndarray, " time"]:
    """Whether the object's own axis leans more than 30° from the vertical: z of (first × second axis)."""
    first_x, first_y, second_x, second_y = pose[3], pose[4], pose[6], pose[7]
    return first_x * second_y - first_y * second_x < TIPPED_COSINE
