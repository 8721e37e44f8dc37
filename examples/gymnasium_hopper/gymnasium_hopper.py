"""A robot of Gymnasium's: MuJoCo's hopper, a leg with a foot, is to go far and not to fall.

From this folder: svaedc collect --setup gymnasium_hopper --episodes 2000 --dataset data
"""

import math
from functools import partial
from typing import Any

import gymnasium
import mujoco
import numpy as np

from workers.controllers.sinusoids import Sinusoids
from workers.environments.environment import Channel
from workers.gymnasium_setup import gymnasium_setup, has_terminated
from workers.physics import Physics, PhysicsRanges, around
from workers.setups import Setup
from workers.simulation.sketch import Canvas, Sketch, State

JOINTS = ("thigh", "leg", "foot")
NOMINAL = {"torso_mass": 3.67, "foot_friction": 2.0, "damping": 1.0}  # kg, a coefficient, N·m·s/rad
HORIZON = 150  # control steps of 8 ms
LEAN = 0.6  # rad

OBSERVATION = (
    Channel("x", "m", -5.0, 10.0),
    Channel("height", "m", 0.0, 3.0),
    Channel("pitch", "rad", -1.5, 1.5),
    *(Channel(joint, "rad", -3.0, 1.5) for joint in JOINTS),
    *(Channel(f"{name}_speed", "m/s", -10.0, 10.0) for name in ("x", "height")),
    *(Channel(f"{name}_speed", "rad/s", -10.0, 10.0) for name in ("pitch", *JOINTS)),
)
ACTION = tuple(Channel(f"{joint}_torque", "200 N·m", -1.0, 1.0) for joint in JOINTS)


def apply(environment: gymnasium.Env[Any, Any], physics: Physics) -> None:
    """Put the physics into MuJoCo's model; what follows from masses is computed anew."""
    model, data = environment.unwrapped.model, environment.unwrapped.data
    model.body("torso").mass = physics["torso_mass"]
    model.geom("foot_geom").friction[0] = physics["foot_friction"]
    for joint in JOINTS:
        model.joint(f"{joint}_joint").damping = physics["damping"]
    mujoco.mj_setConst(model, data)


def draw(canvas: Canvas, state: State) -> None:
    """The ground with a mark every half metre, and the four capsules that MuJoCo's model is made of."""
    canvas.box((2.0, -0.5), size=(20.0, 1.0), color="lightgray")
    for half in range(-10, 21):
        canvas.line([(half / 2, 0.0), (half / 2, -0.08 if half % 2 else -0.16)], width=0.015, color="gray")
    head, hip, knee, ankle, heel, toe = skeleton(state)
    canvas.line([heel, toe], width=0.12, color="peru")
    canvas.line([ankle, knee], width=0.08, color="steelblue")
    canvas.line([knee, hip], width=0.1, color="royalblue")
    canvas.line([hip, head], width=0.1, color="navy")


def skeleton(state: State) -> list[np.ndarray]:
    """Head, hip, knee, ankle, heel and toe in the plane, in m."""
    pitch = state["pitch"]
    thigh = pitch - state["thigh"]
    leg = thigh - state["leg"]
    foot = leg - state["foot"]
    torso = np.array([state["x"], state["height"]])
    head, hip = (torso + _turn((0.0, up), pitch) for up in (0.2, -0.2))
    knee = hip + _turn((0.0, -0.45), thigh)
    ankle = knee + _turn((0.0, -0.5), leg)
    heel, toe = (ankle + _turn((along, 0.0), foot) for along in (-0.13, 0.26))
    return [head, hip, knee, ankle, heel, toe]


def _turn(place: tuple[float, float], angle: float) -> np.ndarray:
    """Turn a place to the right by an angle, as MuJoCo turns about +y."""
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([place[0] * cosine + place[1] * sine, place[1] * cosine - place[0] * sine])


def setup() -> Setup:
    """What `--setup gymnasium_hopper` loads."""
    training = around(NOMINAL, 0.1)
    fixed = {name: (value, value) for name, value in NOMINAL.items()}
    return gymnasium_setup(
        partial(
            gymnasium.make,
            "Hopper-v5",
            exclude_current_positions_from_observation=False,
            healthy_angle_range=(-1.0, 1.0),  # rad; its own 0.2 ends nearly every episode at once
            healthy_z_range=(0.5, math.inf),  # m
            disable_env_checker=True,
        ),
        action=ACTION,
        observation=OBSERVATION,
        controller=Sinusoids(ACTION, frequency=(1.0, 4.0), amplitude=0.3, center=0.1),
        bad={"fallen": has_terminated, "leans": lambda observed: abs(observed.xi[2]) > LEAN},
        horizon=HORIZON,
        physics=training,
        gaps={
            "paper": PhysicsRanges(fixed | {"torso_mass": training.intervals["torso_mass"]}),
            "wide": around(NOMINAL, 0.3),
        },
        apply=apply,
        objective_limits=(-50.0, 350.0),
        success=150.0,
        scenery=Sketch(draw, x=(-1.2, 2.0), y=(-0.4, 2.0)),
    )
