"""Gaits from central pattern generators: coupled oscillators, one per joint (Crespi and Ijspeert 2008).

    θ̇_i = 2π v_i + Σ_j w sin(θ_j − θ_i − φ_ij)
    r̈_i = a (a/4 (R_i − r_i) − ṙ_i)
    output_i = r_i (1 + cos θ_i) − o_i

The amplitude r starts at R and at rest, and so stays there: r = R, whatever a. Every base is coupled to every
other base, and each shoulder and elbow to the base of its leg, all with w = 10; θ starts at 0.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import inf, pi
from typing import Any

import numpy as np
from jaxtyping import Float, Float32

from workers.controllers.arrays import constant, namespace
from workers.controllers.controller import Command, Controller, PlanTimes
from workers.environments.environment import Channel
from workers.plans import JointPlan, PlannedCommand

LEGS = ("LF", "LM", "LB", "RB", "RM", "RF")
"""The oscillators stand in this order, once around the body."""
KINDS = ("base", "shoulder", "elbow")
COUPLING = 10.0  # w, 1/s
TIME_STEP = 0.01  # s of the oscillators' time in each control step
ELBOW_CENTER = -1.0  # rad, added to the elbows' outputs: the tibia points down

_COMMAND_LEGS = [0, 5, 1, 4, 2, 3]  # oscillators in the order of the robot's legs: LF RF LM RM LB RB
_SIDES = np.array([1.0, -1.0, 1.0, -1.0, 1.0, -1.0])  # left and right legs mirror each other


@dataclass(frozen=True)
class Gait:
    """The numbers of a pattern generator; rows are base, shoulder and elbow, columns the legs in ring order.

    Attributes:
        shifts: rad, [..., 3, 6]; two coupled oscillators are in step when θ + shift is the same for both.
        frequency: v of each row, [..., 3], in Hz of the oscillators' time.
        amplitude: R of each row, [..., 3], in rad.
        offset: o of each row, [..., 3], in rad.
    """

    shifts: Any
    frequency: Any
    amplitude: Any
    offset: Any


def phases(gait: Gait, steps: int) -> Float[np.ndarray, "steps 3 6"]:
    """Integrate the oscillators by Euler steps.

    In ψ = θ + shift no coupling has a bias, and the sum over all bases needs one sine and cosine of each:
    Σ_j sin(ψ_j − ψ_i) = cos ψ_i Σ_j sin ψ_j − sin ψ_i Σ_j cos ψ_j.

    Args:
        gait: numbers of the pattern generator.
        steps: how many, each of `TIME_STEP`.

    Returns:
        θ after each step, in rad, [steps, 3, 6], rows and columns as in `Gait`; it is not wrapped.
    """
    psi = np.array(gait.shifts)
    free = TIME_STEP * 2 * pi * gait.frequency[:, None]
    gain = TIME_STEP * COUPLING
    course = np.empty((steps, 3, 6))
    for step in range(steps):
        base = psi[0]
        sine, cosine = np.sin(base), np.cos(base)
        pull = gain * np.sin(psi[1:] - base)
        psi += free
        base += gain * (cosine * sine.sum() - sine * cosine.sum()) + pull[0] + pull[1]
        psi[1:] -= pull
        course[step] = psi
    return course - gait.shifts


def planned_phases(gait: Gait, steps: np.ndarray) -> Any:
    """The same for many gaits at once, at some steps, by Euler steps of twice the length.

    Args:
        gait: numbers of n pattern generators, each field with n in front: arrays of NumPy or torch.
        steps: at whose ends phases are told, rising.

    Returns:
        θ in rad, [n, S, 3, 6].
    """
    xp, told, course = namespace(gait.shifts), set(steps.tolist()), []
    base, joints = gait.shifts[:, 0], gait.shifts[:, 1:]
    free, gain = 2 * TIME_STEP * 2 * pi * gait.frequency[:, :, None], 2 * TIME_STEP * COUPLING
    for step in range(2, int(steps[-1]) + 2, 2):
        sine, cosine = xp.sin(base), xp.cos(base)
        pull = gain * xp.sin(joints - base[:, None])
        meeting = cosine * sine.sum(1)[:, None] - sine * cosine.sum(1)[:, None]
        base = base + free[:, 0] + gain * meeting + pull.sum(1)
        joints = joints + free[:, 1:] - pull
        course += [xp.concatenate([base[:, None], joints], 1)] * len({step - 1, step} & told)
    return xp.stack(course, 1) - gait.shifts[:, None]


def outputs(gait: Gait, steps: int) -> Float[np.ndarray, "steps 3 6"]:
    """Integrate the oscillators for their outputs R (1 + cos θ) − o.

    Args:
        gait: numbers of the pattern generator.
        steps: how many, each of `TIME_STEP`.

    Returns:
        Outputs after each step, in rad, [steps, 3, 6], rows and columns as in `Gait`.
    """
    return gait.amplitude[:, None] * (1 + np.cos(phases(gait, steps))) - gait.offset[:, None]


class PatternGenerator(Controller):
    """Joint angles of a hexapod from a pattern generator that is not fed back.

    A left leg's joint is commanded direction · output (the elbow −1 + direction · output), a right leg's the
    opposite of that; all are clipped to ± the limits.

    Args:
        parameters: of the controller.
        gait: from their values, [..., D], to the pattern generator.
        directions: +1 or −1 for base, shoulder and elbow.
        limits: greatest commanded angle of base, shoulder and elbow, in rad.
    """

    def __init__(
        self,
        *,
        parameters: tuple[Channel, ...],
        gait: Callable[[Float[np.ndarray, " d"]], Gait],
        directions: tuple[float, float, float],
        limits: tuple[float, float, float],
    ) -> None:
        self.parameters = parameters
        self._gait = gait
        self._directions = np.array(directions)[:, None]
        self._limits = np.array(limits)

    @property
    def planned(self) -> tuple[Channel, ...]:
        """The commanded angle of every joint."""
        legs = [LEGS[place] for place in _COMMAND_LEGS]
        kinds = list(zip(KINDS, self._limits.tolist(), strict=True))
        return tuple(Channel(f"{leg}_{kind}", "rad", -limit, limit) for leg in legs for kind, limit in kinds)

    def plans(self, x: Any, moments: PlanTimes) -> Any:
        """What is commanded, integrated with half as many steps.

        Args:
            x: controllers in the unit cube, [n, D], an array of NumPy or torch.
            moments: when.

        Returns:
            The channels of `planned`, [n, 18, S].
        """
        xp, gait = namespace(x), self._gait(self.physical(x))
        course = planned_phases(gait, moments.steps)
        swing = gait.amplitude[:, None, :, None] * (1 + xp.cos(course)) - gait.offset[:, None, :, None]
        center = constant([[0.0], [0.0], [ELBOW_CENTER]], x)
        left = constant(self._directions, x) * swing + center
        angles = left[:, :, :, _COMMAND_LEGS] * constant(_SIDES, x)
        limits = constant(self._limits[:, None], x)
        held = xp.swapaxes(xp.minimum(xp.maximum(angles, -limits), limits), 2, 3)
        return xp.swapaxes(held.reshape(x.shape[0], len(moments.steps), -1), 1, 2)

    def start(self, x: Float32[np.ndarray, " d"], environment: Any, horizon: int) -> Command:  # noqa: ARG002
        """Plan all commands at once: nothing that happens to the robot changes them.

        Args:
            x: the controller, [D], in [0, 1].
            environment: not looked at.
            horizon: T, control steps.

        Returns:
            18 joint angles in rad for each step.
        """
        rows = self.commands(x, horizon)

        def command(step: int) -> list[float]:
            return rows[step].tolist()

        joints = rows.shape[1]
        return PlannedCommand(command, JointPlan(rows, (-inf,) * joints, (inf,) * joints))

    def commands(self, x: Float32[np.ndarray, " d"], horizon: int) -> Float[np.ndarray, "horizon 18"]:
        """Plan the joint angles of all steps.

        Args:
            x: the controller, [D], in [0, 1].
            horizon: T, control steps.

        Returns:
            Angles in rad, [horizon, 18]: legs LF RF LM RM LB RB, each with base, shoulder, elbow.
        """
        left = self._directions * outputs(self._gait(self.values(x)), horizon)
        left[:, 2] += ELBOW_CENTER
        angles = (left[:, :, _COMMAND_LEGS] * _SIDES).transpose(0, 2, 1)
        return np.clip(angles, -self._limits, self._limits).reshape(horizon, -1)


def _shifts(base: Any, joints: Any) -> Any:
    """Base phases [..., 1, 6]; each shoulder and elbow [..., 2, 6 or 1] lags behind its base by so much."""
    return namespace(base).concatenate([-base, joints - base], -2)


def _phase(*names: str) -> tuple[Channel, ...]:
    return tuple(Channel(f"{name}_phase", "rad", -pi, pi) for name in names)


BASE_PHASES = _phase(*(f"{leg}_base" for leg in LEGS))


def cpg_27d(limits: tuple[float, float, float]) -> PatternGenerator:
    """18 phases; frequency, amplitude and offset of bases, shoulders and elbows."""
    joints = _phase(*(f"{leg}_{kind}" for kind in KINDS[1:] for leg in LEGS))
    waves = [("frequency", "Hz", 2.0), ("amplitude", "rad", 1.0), ("offset", "rad", 1.0)]
    shared = (Channel(f"{kind}_{name}", unit, 0.0, high) for name, unit, high in waves for kind in KINDS)

    def gait(values: Any) -> Gait:
        shifts = _shifts(values[..., None, :6], values[..., 6:18].reshape(*values.shape[:-1], 2, 6))
        return Gait(shifts, values[..., 18:21], values[..., 21:24], values[..., 24:])

    parameters = (*BASE_PHASES, *joints, *shared)
    return PatternGenerator(parameters=parameters, gait=gait, directions=(1.0, 1.0, 1.0), limits=limits)


def cpg_11d(limits: tuple[float, float, float]) -> PatternGenerator:
    """6 base phases; the phases of all shoulders and of all elbows behind them; one wave for all joints."""
    waves = (
        Channel("frequency", "Hz", 0.5, 1.0),
        Channel("amplitude", "rad", 0.5, 1.0),
        Channel("offset", "rad", 0.5, 1.0),
    )

    def gait(values: Any) -> Gait:
        shifts = _shifts(values[..., None, :6], values[..., 6:8, None])
        return Gait(shifts, *(values[..., [place] * 3] for place in (8, 9, 10)))

    parameters = (*BASE_PHASES, *_phase(*KINDS[1:]), *waves)
    return PatternGenerator(parameters=parameters, gait=gait, directions=(-1.0, -1.0, 1.0), limits=limits)
