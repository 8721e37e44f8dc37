"""The robots known by name: rehearsals of setups, those of installed packages, and a user's own."""

import sys
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Final

from workers import plug_ins, setups
from workers.hardware.host_process import Machinery
from workers.hardware.hosted import HostedRobot
from workers.host.home import RobotHome
from workers.host.limits import RobotLimits
from workers.plug_ins import Kind, Part
from workers.user_modules import call

STAND_IN = "simulated stand-in"
"""These words stand wherever the result of one does, so that nobody takes it for a robot's."""
REHEARSAL: Final = "rehearsal:"
"""This before the name of a setup names the rehearsal of it."""
GAP = "wide"
"""The hidden physics of a rehearsal is drawn from this one of its setup's gaps."""
LONGEST_PACE_SECONDS = 86_400.0
"""The pace is at most a day, for a clock cannot wait for just any number."""
_REHEARSED: Final = "workers.hardware.rehearsal:RehearsalMachine"


@dataclass(frozen=True)
class Robot:
    """What is known of a robot before it is connected.

    Attributes:
        name: under which it is asked for; what a user's own calls itself is replaced by that.
        setup: name of the setup it realises.
        machine: its driver, as `module:name` of a subclass of `workers.host.machine.RobotMachine`.
        python: interpreter of the environment that the driver is installed in.
        settings: keyword arguments of the machine, plain values.
        simulated: whether it is a simulated stand-in, whose trials need nobody's approval.
    """

    name: str
    setup: str
    machine: str
    python: str = sys.executable
    settings: Mapping[str, Any] = field(default_factory=dict)
    simulated: bool = False

    def connect(self, seed: int, pace: float, home: RobotHome, limits: RobotLimits) -> HostedRobot:
        """The robot behind its host, which starts when it is first asked something.

        Args:
            seed: of the campaign; the hidden physics of a stand-in follows from it alone.
            pace: least duration of a stand-in's trial, in s, at most a day; 0 as fast as it simulates.
            home: of the robot, which the caller holds.
            limits: of the robot.

        Returns:
            The robot.

        Raises:
            ValueError: the pace is negative, longer than a day, or no number.
        """
        if not 0.0 <= pace <= LONGEST_PACE_SECONDS:
            raise ValueError(f"pace must lie in [0, {LONGEST_PACE_SECONDS:.0f}] s, got {pace}")
        settings = {**self.settings, "seed": seed} if self.simulated else self.settings
        machinery = Machinery(self.machine, self.python, settings, self.simulated)
        period = (
            pace / setups.load(str(self.settings.get("simulated", self.setup))).horizon
            if self.simulated
            else None
        )
        return HostedRobot(self.name, self.setup, home, machinery, limits, period)


def _rehearsal(name: str, setup: str, simulated: str) -> Robot:
    """A setup as a robot, for models and methods that know only `setup`.

    Args:
        name: of the robot.
        setup: what they know.
        simulated: the setup that moves; it may be another one, which stands in for it.
    """
    settings = {"setup": setup, "simulated": simulated}
    return Robot(name, setup, _REHEARSED, settings=settings, simulated=True)


ROBOTS: Mapping[str, Robot] = MappingProxyType(
    {
        name: _rehearsal(name, setup, name)
        for name, setup in {
            "franka-rehearsal": "franka",
            "yumi-rehearsal": "yumi",
            "daisy-11d-rehearsal": "daisy-11d",
        }.items()
    }
)
"""These robots ship; each is simulated by the setup of its own name."""
KIND: Final = Kind("robot", "svaedc.robots", ROBOTS)


def find(name: str) -> Robot:
    """The robot of that name.

    It is one that ships; or `rehearsal:SETUP`, the simulation of any setup that has hidden physics for it; or
    the entry point of that name of an installed package, in the group `svaedc.robots`; or `module:name`, a
    Robot in that module or a function that returns one.

    Raises:
        LookupError: there is none (it names the nearest), or it is not as it must be.
    """
    if name in ROBOTS:
        return ROBOTS[name]
    if name.startswith(REHEARSAL):
        return _rehearsal_of(name)
    return replace(_robot_of(plug_ins.find(name, KIND)), name=name)


def stands_in_for(setup: str) -> str:
    """The setup whose data and models a stand-in of that name works with; "" for every other setup."""
    return ROBOTS[setup].setup if setup in ROBOTS else ""


def _rehearsal_of(name: str) -> Robot:
    """The rehearsal of a setup, which is loaded to see whether it can be rehearsed."""
    setup = name.removeprefix(REHEARSAL)
    gaps = setups.load(setup).gaps
    if GAP not in gaps:
        raise LookupError(
            f"{name} draws its hidden physics from the gap {GAP!r}, which the setup {setup!r} does not have "
            f"(it has {', '.join(gaps) or 'none'}): add it to the setup's `gaps`"
        )
    return _rehearsal(name, setup, setup)


def _robot_of(part: Part) -> Robot:
    made = (
        part.value
        if isinstance(part.value, Robot) or not callable(part.value)
        else call(part.name, part.value)
    )
    if not isinstance(made, Robot):
        raise LookupError(
            f"{part.name} must be a workers.hardware.robots.Robot or a function without arguments that "
            f"returns one, got {type(made).__name__}"
        )
    return made
