"""Daisy, a hexapod that walks: the setups `daisy-27d`, `daisy-11d`, both `-mujoco`, `daisy-11d-rehearsal`."""

from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from math import pi

from workers.controllers.controller import Controller
from workers.controllers.cpg import cpg_11d, cpg_27d
from workers.environments.daisy import (
    BODY,
    CONTROL_STEP,
    NOMINAL,
    TRUE_SPEEDS,
    UNLIMITED,
    Daisy,
    DaisyModel,
    observation,
)
from workers.physics import PhysicsRanges, around
from workers.setups.engines import in_mujoco
from workers.setups.setup import Setup
from workers.tasks.stop import WalkGuard
from workers.tasks.walk import Walk

TASK = Walk(channel=BODY)
SUCCESS = 15.0  # f of 1.5 m (section 6 of the paper) without a fast joint

HORIZON_27D = 1000  # control steps: 16.7 s (section 6 of the paper)
REACH_27D = (pi, pi, pi)  # rad, the joints' own limits
MODEL_27D = DaisyModel(speeds=UNLIMITED, reach=REACH_27D)
LIMITS_27D = (-250.0, 50.0)  # 200 random controllers: -168 to 18; 50 is 5 m without a fast joint

HORIZON_11D = 1500  # control steps: 25 s (section 6 of the paper)
REACH_11D = (0.6, 1.0, 1.5)  # rad, as on the hardware
MODEL_11D = DaisyModel(speeds=UNLIMITED, reach=REACH_11D)
LIMITS_11D = (-300.0, 80.0)  # 200 random controllers: -233 to 31; 80 is 8 m without a fast joint

REHEARSAL_FRICTION = 1.0  # of rubber on carpet; half of what the data are collected under
REHEARSAL_LIMITS = (-100.0, 80.0)  # 200 random controllers: -71 to 65


def daisy_27d() -> Setup:
    """Daisy as in the paper's simulations: 27 parameters, 1000 steps at 60 Hz, motors of unlimited speed."""
    return _walking(
        name="daisy-27d",
        model=MODEL_27D,
        controller=cpg_27d(REACH_27D),
        horizon=HORIZON_27D,
        nominal=NOMINAL,
        objective_limits=LIMITS_27D,
    )


def daisy_11d() -> Setup:
    """Daisy with the controller of the paper's hardware: 11 parameters, 1500 steps at 60 Hz."""
    return _walking(
        name="daisy-11d",
        model=MODEL_11D,
        controller=cpg_11d(REACH_11D),
        horizon=HORIZON_11D,
        nominal=NOMINAL,
        objective_limits=LIMITS_11D,
    )


def daisy_27d_mujoco() -> Setup:
    """The setup `daisy-27d` in another engine.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    return in_mujoco(daisy_27d(), MODEL_27D)


def daisy_11d_mujoco() -> Setup:
    """The setup `daisy-11d` in another engine.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    return in_mujoco(daisy_11d(), MODEL_11D)


def daisy_11d_rehearsal() -> Setup:
    """A stand-in for the paper's real Daisy: 11 parameters, 3.142, 1.571 and 3.142 rad/s at most.

    The motors have their true limits of speed, the ground is more slippery, and an episode ends where the
    robot leaves the walkway or falls over: f is then what it has walked up to there.
    """
    free = _walking(
        name="daisy-11d-rehearsal",
        model=DaisyModel(speeds=TRUE_SPEEDS, reach=REACH_11D),
        controller=cpg_11d(REACH_11D),
        horizon=HORIZON_11D,
        nominal={**NOMINAL, "friction": REHEARSAL_FRICTION},
        objective_limits=REHEARSAL_LIMITS,
    )
    return replace(free, stop=WalkGuard(TASK))


def _walking(
    *,
    name: str,
    model: DaisyModel,
    controller: Controller,
    horizon: int,
    nominal: Mapping[str, float],
    objective_limits: tuple[float, float],
) -> Setup:
    """A setup in which Daisy walks towards +y for so many control steps."""
    levels = gaps(nominal)
    return Setup(
        name=name,
        build=partial(Daisy, model),
        controller=controller,
        task=TASK,
        observation=observation(),
        horizon=horizon,
        control_step=CONTROL_STEP,
        physics=levels["training"],
        gaps=levels,
        objective_limits=objective_limits,
        success=SUCCESS,
    )


def gaps(nominal: Mapping[str, float]) -> dict[str, PhysicsRanges]:
    """The paper varied restitution alone; collection varies everything by 20 %, `wide` by 50 %."""
    training = around(nominal, 0.2)
    fixed = {name: (value, value) for name, value in nominal.items()}
    return {
        "paper": PhysicsRanges(fixed | {"restitution": training.intervals["restitution"]}),
        "training": training,
        "wide": around(nominal, 0.5),
    }
