"""Daisy as in the paper's simulations: the setup `daisy-27d`, 1000 steps at 60 Hz (16.7 s)."""

from math import pi

from workers.controllers.cpg import cpg_27d
from workers.environments.daisy import NOMINAL, UNLIMITED, DaisyModel
from workers.environments.daisy_setup import walking
from workers.setups import Setup

HORIZON = 1000  # control steps (section 6 of the paper)
REACH = (pi, pi, pi)  # rad, the joints' own limits
MODEL = DaisyModel(speeds=UNLIMITED, reach=REACH)
OBJECTIVE_LIMITS = (-250.0, 50.0)  # 200 random controllers: -168 to 18; 50 is 5 m without a fast joint


def setup() -> Setup:
    """The setup `daisy-27d`: 27 parameters, no limit on the motors' speed."""
    return walking(
        name="daisy-27d",
        model=MODEL,
        controller=cpg_27d(REACH),
        horizon=HORIZON,
        nominal=NOMINAL,
        objective_limits=OBJECTIVE_LIMITS,
    )
