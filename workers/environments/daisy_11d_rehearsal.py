"""A stand-in for the paper's real Daisy: the setup `daisy-11d-rehearsal`, which differs from `daisy-11d`.

The motors have their true limits of speed, the ground is more slippery, and an episode ends where the robot
leaves the walkway or falls over: f is then what it has walked up to there.
"""

from dataclasses import replace

from workers.controllers.cpg import cpg_11d
from workers.environments.daisy import NOMINAL, TRUE_SPEEDS, DaisyModel
from workers.environments.daisy_11d import HORIZON, REACH
from workers.environments.daisy_setup import TASK, walking
from workers.setups import Setup
from workers.tasks.stop import WalkGuard

MODEL = DaisyModel(speeds=TRUE_SPEEDS, reach=REACH)
FRICTION = 1.0  # of rubber on carpet; half of what the data are collected under
OBJECTIVE_LIMITS = (-100.0, 80.0)  # 200 random controllers: -71 to 65


def setup() -> Setup:
    """The setup `daisy-11d-rehearsal`: 11 parameters, 3.142, 1.571 and 3.142 rad/s at most."""
    free = walking(
        name="daisy-11d-rehearsal",
        model=MODEL,
        controller=cpg_11d(REACH),
        horizon=HORIZON,
        nominal={**NOMINAL, "friction": FRICTION},
        objective_limits=OBJECTIVE_LIMITS,
    )
    return replace(free, stop=WalkGuard(TASK))
