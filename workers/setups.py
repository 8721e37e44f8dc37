"""Setups by name: an environment, a controller and a task that belong together."""

import difflib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module

from workers.controllers.controller import Controller
from workers.environments.environment import Channel, Environment
from workers.physics import PhysicsRanges, ranges
from workers.tasks.stop import STOPPED, StopRule, never
from workers.tasks.task import Task

MODULES = {
    "franka": "workers.environments.franka",
    "daisy-27d": "workers.environments.daisy_27d",
    "daisy-11d": "workers.environments.daisy_11d",
    "daisy-11d-rehearsal": "workers.environments.daisy_11d_rehearsal",
    "franka-rehearsal": "workers.environments.franka_rehearsal",
    "yumi": "workers.environments.yumi",
    "yumi-rehearsal": "workers.environments.yumi_rehearsal",
}
"""A new robot is one module that offers `setup()`, and one line here."""


@dataclass(frozen=True)
class Setup:
    """A robot, its controller and its task.

    Attributes:
        name: as on the command line.
        build: makes the simulated environment.
        controller: the parametric controller.
        task: G_bad and the objective.
        observation: the channels of ξ.
        horizon: T, control steps of an episode.
        control_step: seconds of each.
        physics: ranges of data collection.
        gaps: ranges of the hidden physics of a BO run, by the name of the gap level.
        objective_limits: the range of f, fixed; BO scales f by it.
        success: an episode with f above this succeeded.
        stop: ends an episode early; of stand-ins for hardware only.
    """

    name: str
    build: Callable[[], Environment]
    controller: Controller
    task: Task
    observation: tuple[Channel, ...]
    horizon: int
    control_step: float
    physics: PhysicsRanges
    gaps: Mapping[str, PhysicsRanges]
    objective_limits: tuple[float, float]
    success: float
    stop: StopRule = never

    @property
    def dimensions(self) -> int:
        """D, the length of x."""
        return self.controller.dimensions

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the bad conditions, in the order of their bits; `stopped` comes last if it may be."""
        return self.task.conditions if self.stop is never else (*self.task.conditions, STOPPED)

    def open(self) -> Environment:
        """Start the simulated environment; close it, or use it in a `with` block."""
        return self.build()

    def gap(self, level: str) -> PhysicsRanges:
        """Ranges of a sim-to-real gap level, or those written out, such as `friction=1:2.5,restitution=0.05`.

        Parameters that are not written out keep the middle of their range of data collection.

        Raises:
            LookupError: when there is no such level or no such parameter; the message names the nearest.
            ValueError: when a range is not written as `workers.physics.ranges` reads it, or is impossible.
        """
        if "=" not in level:
            return self.gaps[known(level, "gap level", self.gaps)]
        fixed = {name: ((low + high) / 2,) * 2 for name, (low, high) in self.physics.intervals.items()}
        written = ranges(level).intervals
        for name in written:
            known(name, "physics parameter", fixed)
        return PhysicsRanges({**fixed, **written})


def known(name: str, kind: str, names: Mapping[str, object]) -> str:
    """The name itself if it is one of the names; otherwise a `LookupError` that suggests the nearest."""
    if name in names:
        return name
    nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.0)
    hint = f"did you mean {nearest[0]!r}? " if nearest else ""
    raise LookupError(f"unknown {kind} {name!r}; {hint}known: {', '.join(names)}")


def load(name: str) -> Setup:
    """The setup of that name; an unknown one raises `LookupError` and names the nearest."""
    return import_module(MODULES[known(name, "setup", MODULES)]).setup()
