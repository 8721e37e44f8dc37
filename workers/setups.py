"""Setups by name: an environment, a controller and a task that belong together."""

import difflib
import hashlib
import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from workers.controllers.controller import Controller
from workers.environments.environment import Channel, Environment
from workers.physics import PhysicsRanges, ranges
from workers.tasks.stop import STOPPED, StopRule, never
from workers.tasks.task import BITS, Task

MODULES = {
    "franka": "workers.environments.franka",
    "daisy-27d": "workers.environments.daisy_27d",
    "daisy-11d": "workers.environments.daisy_11d",
    "daisy-11d-rehearsal": "workers.environments.daisy_11d_rehearsal",
    "quadratic-30d": "workers.environments.quadratic_30d",
    "quadratic-30d-intrinsic-3": "workers.environments.quadratic_30d_intrinsic_3",
    "franka-rehearsal": "workers.environments.franka_rehearsal",
    "yumi": "workers.environments.yumi",
    "yumi-rehearsal": "workers.environments.yumi_rehearsal",
}
"""A new robot is one module that offers `setup()`, and one line here; none for a module of the user's own."""


@dataclass(frozen=True)
class Setup:
    """A robot, its controller and its task.

    Attributes:
        name: as on the command line; of a user's module, the module's name.
        build: makes the simulated environment.
        controller: the parametric controller.
        task: G_bad and the objective.
        observation: the channels of ξ.
        horizon: T, control steps of an episode.
        control_step: seconds of each.
        physics: ranges of data collection.
        gaps: ranges of the hidden physics of a BO run, by the name of the gap level.
        objective_limits: the objectives that BO sees as 0 and 1, fixed. No f is clipped to them: one outside
            is seen below 0 or above 1. A diverged episode has the lower one.
        success: an episode with f above this succeeded.
        stop: ends an episode early; of stand-ins for hardware only.
        code: SHA-256 of the file of a user's module; "" for the setups that ship.
        broken: an episode with f below this broke something; NaN where f does not tell.
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
    code: str = ""
    broken: float = math.nan

    def __post_init__(self) -> None:
        """Refuse bad conditions that the bits of a step cannot hold, or that cannot be told apart."""
        names, graded = self.task.conditions, self.task.graded
        if graded and len(names) != 1:
            raise ValueError(
                f"{self.name} has a graded task, which must have one name in `conditions`, that of its "
                f"degree, got {len(names)}: {', '.join(names)}; leave one"
            )
        if not 1 <= len(self.conditions) <= BITS:
            raise ValueError(
                f"{self.name} must have 1 to {BITS} bad conditions, {STOPPED!r} of a stop rule included, got "
                f"{len(self.conditions)}: {', '.join(self.conditions)}; join some of them"
            )
        if len({*names}) != len(names) or (STOPPED in names and not graded):
            raise ValueError(
                f"the bad conditions of {self.name} must differ, and none be called {STOPPED!r}, got "
                f"{', '.join(names)}; rename one"
            )

    @property
    def dimensions(self) -> int:
        """D, the length of x."""
        return self.controller.dimensions

    @property
    def conditions(self) -> tuple[str, ...]:
        """Names of the bad conditions, in the order of their bits; `stopped` comes last if it may be.

        A graded G_bad has no bits: a stop gives its steps the degree 1.
        """
        bits = self.stop is not never and not self.task.graded
        return (*self.task.conditions, STOPPED) if bits else self.task.conditions

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
        fixed = {name: (value, value) for name, value in self.physics.middle().items()}
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
    """The setup of that name, or of the importable module of that name, which offers `setup()`.

    Raises:
        LookupError: there is neither (it names the nearest), or the module is not as it must be.
    """
    if name in MODULES or not _is_module(name):
        return import_module(MODULES[_shipped(name)]).setup()
    made = getattr(imported(name), "setup", lambda: None)()
    if not isinstance(made, Setup):
        raise LookupError(
            f"module {name!r} must offer a function setup() that returns a workers.setups.Setup"
        )
    return replace(made, name=name, code=file_digest(imported(name)))


def _shipped(name: str) -> str:
    try:
        return known(name, "setup", MODULES)
    except LookupError as error:
        raise LookupError(f"{error.args[0]}; nor is there a module of that name to import") from error


def imported(name: str) -> ModuleType:
    """A user's module; one that cannot be imported raises `LookupError` with the reason."""
    try:
        return import_module(name)
    except (ImportError, SyntaxError) as error:
        raise LookupError(
            f"cannot import the module {name!r}: {error}; it must be in the working directory or on "
            "PYTHONPATH, on every machine of the cluster"
        ) from error


def file_digest(part: object) -> str:
    """SHA-256 of the file that defines a module or function."""
    return hashlib.sha256(Path(inspect.getfile(cast(Any, part))).read_bytes()).hexdigest()


def _is_module(name: str) -> bool:
    parts = name.split(".")
    return all(part.isidentifier() for part in parts) and (len(parts) > 1 or find_spec(name) is not None)
