"""What stands in for a real Franka Emika: the simulation with limited joint speeds: `franka-rehearsal`."""

from dataclasses import replace

from workers.environments import franka
from workers.setups import Setup

SPEED_LIMIT = (
    2.175  # rad/s, of the joints 1 to 4; the others may reach 2.61, but Bullet has one limit for all
)


def setup() -> Setup:
    """The setup `franka-rehearsal`."""
    arm = replace(franka.ARM, speed_limit=SPEED_LIMIT)
    return franka.setup_of("franka-rehearsal", replace(franka.MODEL, arm=arm))
