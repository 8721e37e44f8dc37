"""When an episode ends early: rules that look at one step and give a reason."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from workers.environments.environment import Observed
from workers.tasks.walk import Walk, roll_and_pitch

StopRule = Callable[[Observed], str]
"""It leads from what is seen after one step to the reason to stop there; "" means to go on."""

STOPPED = "stopped"
"""Setups with a stop rule have this bad condition: it holds at the step that gave the reason, and at all that
are not run after it."""

OUTSIDE = "hand outside workspace"
LOW = "hand near table"


OFF_WALKWAY = "body off the walkway"
TILTED = "body tilted"


def never(observed: Observed) -> str:  # noqa: ARG001
    """Of simulated setups, whose episodes run to their horizon."""
    return ""


@dataclass(frozen=True)
class HandGuard:
    """Stops an arm whose hand leaves a rectangle or comes too near to the table.

    Attributes:
        x: extent of the rectangle, in m.
        y: extent of the rectangle, in m.
        lowest: height of the hand's frame, in m, that must not be reached.
    """

    x: tuple[float, float]
    y: tuple[float, float]
    lowest: float

    def __post_init__(self) -> None:
        """Refuse an empty rectangle."""
        for name in ("x", "y"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} must satisfy low < high, got ({low}, {high})")

    def __call__(self, observed: Observed) -> str:
        """The reason, if the last step seen gives one."""
        x, y, z = observed.signals["hand_position"][:, -1]
        if not (self.x[0] <= x <= self.x[1] and self.y[0] <= y <= self.y[1]):
            return OUTSIDE
        if z <= self.lowest or observed.signals["table_contact"][-1]:
            return LOW
        return ""


@dataclass(frozen=True)
class WalkGuard:
    """Stops a walking robot that leaves its walkway or falls over, by the limits of its task.

    Attributes:
        task: what it walks for.
    """

    task: Walk

    def __call__(self, observed: Observed) -> str:
        """The reason, if the last step seen gives one."""
        body = observed.xi[self.task.channel : self.task.channel + 9, -1:]
        if not np.abs(roll_and_pitch(body[3:])).max() <= self.task.tilt:
            return TILTED
        return "" if abs(body[0, 0]) <= self.task.corridor else OFF_WALKWAY
