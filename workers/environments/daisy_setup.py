"""What the setups of Daisy have in common: task, gap levels, and how they are put together."""

from collections.abc import Mapping
from functools import partial

from workers.controllers.controller import Controller
from workers.environments.daisy import BODY, CONTROL_STEP, Daisy, DaisyModel, observation
from workers.physics import PhysicsRanges, around
from workers.setups import Setup
from workers.tasks.walk import Walk

TASK = Walk(channel=BODY)
SUCCESS = 15.0  # f of 1.5 m (section 6 of the paper) without a fast joint


def walking(
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
