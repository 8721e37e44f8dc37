"""What stands in for a real ABB YuMi: slower than the simulation, and stopped early: `yumi-rehearsal`."""

from dataclasses import replace

from workers.environments import yumi
from workers.setups import Setup
from workers.tasks.stop import HandGuard

# Of the arm's joint speeds: a reading of the paper's "1/5". The authors' code notes 0.1 for the robot, at
# which next to nothing is pushed (docs/yumi.md).
SHARE = 0.2
LOWEST_HAND = 0.09  # m; lower, the gripper is about to hit the table


def setup() -> Setup:
    """The setup `yumi-rehearsal`: f is -1.9 m for an episode that was stopped."""
    x, y = ((low - yumi.MARGIN, high + yumi.MARGIN) for low, high in (yumi.TABLE_X, yumi.TABLE_Y))
    return replace(yumi.setup_at("yumi-rehearsal", SHARE), stop=HandGuard(x=x, y=y, lowest=LOWEST_HAND))
