"""A robot of one's own without a physics engine: a cart carries a pole to a mark, 1 m to the right.

From this folder: svaedc collect --setup cart_pole --episodes 2000 --dataset data
"""

import math
from collections.abc import Sequence

import numpy as np

from workers.controllers.linear_feedback import LinearFeedback
from workers.environments.environment import Channel, Environment, Observed
from workers.physics import Physics, PhysicsRanges, around
from workers.setups import Setup
from workers.simulation.sketch import Canvas, Sketch, State
from workers.tasks.task import Task

GRAVITY = 9.81  # m/s²
CART_MASS = 1.0  # kg
FORCE = 10.0  # N, the most that the motor gives
TRACK = 2.4  # m to either side, where the cart is held up
MARK = 1.0  # m
LEAN = 0.15  # rad to the right, at first
FALLEN = 0.5  # rad
NOMINAL = {"pole_mass": 0.1, "pole_length": 1.0, "friction": 0.5, "slope": 0.0}  # kg, m, N·s/m, rad upwards
SLOPE = (-0.02, 0.02)  # rad of the track, to either side
CONTROL_STEP = 0.02  # s
SUBSTEPS = 4
HORIZON = 250  # control steps

OBSERVATION = (
    Channel("position", "m", -TRACK, TRACK),
    Channel("speed", "m/s", -20.0, 20.0),
    Channel("lean_sin", "1", -1.0, 1.0),
    Channel("lean_cos", "1", -1.0, 1.0),
    Channel("lean_speed", "rad/s", -40.0, 40.0),
)
ACTION = (Channel("force", "N", -FORCE, FORCE),)


def draw(canvas: Canvas, state: State) -> None:
    """The track and its mark, the cart, and the pole at its nominal length."""
    x, sine, cosine = state["position"], state["lean_sin"], state["lean_cos"]
    length = NOMINAL["pole_length"]
    canvas.line([(-TRACK - 0.2, 0.0), (TRACK + 0.2, 0.0)], width=0.02, color="gray")
    for end in (-1.0, 1.0):
        canvas.box((end * (TRACK + 0.22), 0.1), size=(0.04, 0.2), color="gray")
    canvas.polygon([(MARK, -0.02), (MARK - 0.06, -0.14), (MARK + 0.06, -0.14)], color="seagreen")
    canvas.box((x, 0.11), size=(0.4, 0.18), color="steelblue")
    canvas.line([(x, 0.2), (x + length * sine, 0.2 + length * cosine)], width=0.05, color="peru")
    canvas.circle((x, 0.2), radius=0.035, color="black")


class CartPole(Environment):
    """The cart and its pole, which leans from the normal of the track; a command is the force on the cart."""

    observation = OBSERVATION
    action = ACTION
    control_step = CONTROL_STEP
    scenery = Sketch(draw, x=(-TRACK - 1.0, TRACK + 1.0), y=(-1.0, 1.4))

    def reset(self, physics: Physics) -> None:
        """At rest in the middle, the pole leaning."""
        self._mass = physics["pole_mass"]
        self._half = physics["pole_length"] / 2
        self._friction = physics["friction"]
        self._pull = -GRAVITY * math.sin(physics["slope"])
        self._x, self._v, self._lean, self._turn = 0.0, 0.0, LEAN, 0.0

    def step(self, command: Sequence[float]) -> tuple[float, ...]:
        """Push for one control step."""
        for _ in range(SUBSTEPS):
            self._move(command[0], CONTROL_STEP / SUBSTEPS)
        return self.record()

    def _move(self, force: float, dt: float) -> None:
        """Barto, Sutton and Anderson (1983), with friction of the cart and a slight slope."""
        sine, cosine = math.sin(self._lean), math.cos(self._lean)
        mass, moment = CART_MASS + self._mass, self._mass * self._half
        push = (force - self._friction * self._v + moment * self._turn**2 * sine) / mass
        bend = (GRAVITY * sine - cosine * push) / (self._half * (4 / 3 - self._mass * cosine**2 / mass))
        self._v += dt * (push + self._pull - moment * bend * cosine / mass)
        self._turn += dt * bend
        self._x += dt * self._v
        self._lean += dt * self._turn
        if abs(self._x) >= TRACK:
            self._x, self._v = math.copysign(TRACK, self._x), 0.0

    def record(self) -> tuple[float, ...]:
        """All that moves; sine and cosine, for an angle jumps when a pole goes round."""
        return self._x, self._v, math.sin(self._lean), math.cos(self._lean), self._turn

    def observed(self, records: Sequence[tuple[float, ...]]) -> Observed:
        """Here everything that is seen is in ξ."""
        return Observed(xi=np.array(records, dtype=np.float32).T, signals={})

    def close(self) -> None:
        """Nothing to end."""


class CarryToTheMark(Task):
    """f = mean over all steps of 1 less the metres to the mark, 0 beyond 1 m and with the pole down."""

    conditions = ("pole_down", "cart_at_the_end")

    def is_bad(self, observed: Observed) -> np.ndarray:
        """One row per condition."""
        x, _, _, cosine, _ = observed.xi
        return np.stack([cosine < math.cos(FALLEN), abs(x) > TRACK - 0.05])

    def objective(self, observed: Observed, bad: np.ndarray) -> float:
        """From 0 to 1."""
        near = np.clip(1.0 - abs(observed.xi[0].astype(np.float64) - MARK), 0.0, 1.0)
        return float(np.where(bad[0], 0.0, near).mean())


def setup() -> Setup:
    """What `--setup cart_pole` loads."""
    training = PhysicsRanges({**around(NOMINAL, 0.2).intervals, "slope": SLOPE})
    fixed = {name: (value, value) for name, value in NOMINAL.items()}
    return Setup(
        name="cart_pole",
        build=CartPole,
        controller=LinearFeedback(
            OBSERVATION,
            ACTION,
            gains={
                "position": (-5.0, 5.0),
                "speed": (-5.0, 10.0),
                "lean_sin": (0.0, 80.0),
                "lean_speed": (0.0, 20.0),
            },
            bias=(-5.0, 5.0),
        ),
        task=CarryToTheMark(),
        observation=OBSERVATION,
        horizon=HORIZON,
        control_step=CONTROL_STEP,
        physics=training,
        gaps={
            "paper": PhysicsRanges(fixed | {"pole_length": training.intervals["pole_length"]}),
            "training": training,
            "wide": PhysicsRanges({**around(NOMINAL, 0.5).intervals, "slope": (-0.05, 0.05)}),
        },
        objective_limits=(0.0, 1.0),
        success=0.5,
    )
