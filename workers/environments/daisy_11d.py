"""Daisy with the controller of the paper's hardware: the setup `daisy-11d`, 1500 steps at 60 Hz (25 s)."""

from workers.controllers.cpg import cpg_11d
from workers.environments.daisy import NOMINAL, UNLIMITED, DaisyModel
from workers.environments.daisy_setup import walking
from workers.setups import Setup

HORIZON = 1500  # control steps: 25 s (section 6 of the paper)
REACH = (0.6, 1.0, 1.5)  # rad, as on the hardware
MODEL = DaisyModel(speeds=UNLIMITED, reach=REACH)
OBJECTIVE_LIMITS = (-300.0, 80.0)  # 200 random controllers: -233 to 31; 80 is 8 m without a fast joint


def setup() -> Setup:
    """The setup `daisy-11d`: 11 parameters, no limit on the motors' speed."""
    return walking(
        name="daisy-11d",
        model=MODEL,
        controller=cpg_11d(REACH),
        horizon=HORIZON,
        nominal=NOMINAL,
        objective_limits=OBJECTIVE_LIMITS,
    )
