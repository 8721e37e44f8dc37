"""What a setup is: an environment, a controller and a task that belong together."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from workers import plain
from workers.controllers.arrays import constant
from workers.controllers.controller import Controller, PlanTimes
from workers.environments.environment import Channel, Environment
from workers.physics import PhysicsRanges, ranges
from workers.setups.names import require_known
from workers.tasks.stop import STOPPED, StopRule, never
from workers.tasks.task import BITS, Task
from workers.user_code import UserCodeError


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
        packages: names of the packages, besides PyBullet and NumPy, whose versions decide the bytes of an
            episode.
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
    packages: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Make what a module states plain, and refuse what no dataset or optimisation can work with.

        Raises:
            UserCodeError: naming the field, what it is, and what it must be.
        """
        self._make_plain()
        self._require_names()
        self._require_conditions()

    def _make_plain(self) -> None:
        """Scalars of NumPy become Python's numbers: they are written into JSON, and compared."""
        name = plain.text(self.name, "the name of a setup")
        broken = plain.plain(self.broken)
        stated = {
            "name": name,
            "horizon": plain.count(self.horizon, f"horizon of {name}"),
            "control_step": plain.positive(self.control_step, f"control_step of {name}"),
            "objective_limits": plain.interval(self.objective_limits, f"objective_limits of {name}"),
            "success": plain.finite(self.success, f"success of {name}"),
            "observation": tuple(self.observation),
            "broken": broken if broken != broken else plain.finite(broken, f"broken of {name}"),
        }
        for field, value in stated.items():
            object.__setattr__(self, field, value)

    def _require_names(self) -> None:
        """Channels, parameters and physics are told apart by their names."""
        if not self.observation or not self.controller.parameters:
            raise UserCodeError(
                f"{self.name} must have at least one channel of ξ and one parameter of its controller, got "
                f"{len(self.observation)} and {len(self.controller.parameters)}"
            )
        plain.distinct((each.name for each in self.observation), f"the channels of {self.name}")
        plain.distinct((each.name for each in self.controller.parameters), f"the parameters of {self.name}")
        for level, gap in self.gaps.items():
            odd = sorted(gap.intervals.keys() ^ self.physics.intervals.keys())
            if odd:
                raise UserCodeError(
                    f"gap {level!r} of {self.name} must have a range for every physics parameter of data "
                    f"collection and for no other; missing or unknown: {', '.join(odd)}"
                )

    def _require_conditions(self) -> None:
        """A step has so many bits, and each condition a name of its own."""
        names, graded = self.task.conditions, self.task.graded
        if graded and len(names) != 1:
            raise UserCodeError(
                f"{self.name} has a graded task, which must have one name in `conditions`, that of its "
                f"degree, got {len(names)}: {', '.join(names)}; leave one"
            )
        if not 1 <= len(self.conditions) <= BITS:
            raise UserCodeError(
                f"{self.name} must have 1 to {BITS} bad conditions, {STOPPED!r} of a stop rule included, got "
                f"{len(self.conditions)}: {', '.join(self.conditions)}; join some of them"
            )
        if len({*names}) != len(names) or (STOPPED in names and not graded):
            raise UserCodeError(
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

    def plans(self, x: Any, samples: int) -> Any:
        """What controllers want before the world answers, in parts of the range of each channel.

        Args:
            x: controllers in the unit cube, [n, D], an array of NumPy or torch; gradients reach it.
            samples: S, equally far apart; the last is the end of the episode.

        Returns:
            The channels of `controller.planned`, [n, channels, S]: −1 and 1 are a channel's bounds, which a
            plan may leave.

        Raises:
            NotImplementedError: the controller offers no plan.
        """
        steps = np.arange(1, samples + 1) * self.horizon // samples
        told = self.controller.plans(x, PlanTimes(steps, self.horizon, self.control_step))
        low, high = (
            constant([[getattr(channel, end)] for channel in self.controller.planned], x)
            for end in ("low", "high")
        )
        return 2.0 * (told - low) / (high - low) - 1.0

    def open(self) -> Environment:
        """Start the simulated environment; close it, or use it in a `with` block."""
        return self.build()

    def under(self, gap: str) -> "Setup":
        """The same with the physics of a gap in place of those of data collection; "" changes nothing."""
        return replace(self, physics=self.gap(gap)) if gap else self

    def gap(self, level: str) -> PhysicsRanges:
        """Ranges of a sim-to-real gap level, or those written out, such as `friction=1:2.5,restitution=0.05`.

        Parameters that are not written out keep the middle of their range of data collection.

        Raises:
            LookupError: when there is no such level or no such parameter; the message names the nearest.
            ValueError: when a range is not written as `workers.physics.ranges` reads it, or is impossible.
        """
        if "=" not in level:
            return self.gaps[require_known(level, "gap level", self.gaps)]
        fixed = {name: (value, value) for name, value in self.physics.middle().items()}
        written = ranges(level).intervals
        for name, (low, _) in written.items():
            require_known(name, "physics parameter", fixed)
            if low < 0 <= self.physics.intervals[name][0]:
                raise ValueError(
                    f"{name} of {self.name} is never below 0 in data collection, so a gap's range must "
                    f"satisfy 0 <= low <= high, got {level!r}"
                )
        return PhysicsRanges({**fixed, **written})
