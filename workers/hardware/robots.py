"""The robots known by name: rehearsals of setups, those of installed packages, and a user's own."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Final

from workers import plug_ins, setups
from workers.hardware.driver import RobotDriver
from workers.hardware.rehearsal import GAP, RehearsalRobot
from workers.plug_ins import Kind, Part
from workers.user_modules import call

STAND_IN = "simulated stand-in"
"""These words stand wherever the result of one does, so that nobody takes it for a robot's."""
REHEARSAL: Final = "rehearsal:"
"""This before the name of a setup names the rehearsal of it."""


@dataclass(frozen=True)
class Robot:
    """What is known of a robot before it is connected.

    Attributes:
        name: under which it is asked for; what a user's own calls itself is replaced by that.
        setup: name of the setup it realises.
        connect: (seed, pace in s, folder for its ledger) -> the driver.
        simulated: whether it is a simulated stand-in, whose trials need nobody's approval.
    """

    name: str
    setup: str
    connect: Callable[[int, float, Path], RobotDriver]
    simulated: bool = False


def _rehearsal(name: str, setup: str, simulated: str) -> Robot:
    """A setup as a robot, for models and methods that know only `setup`.

    Args:
        name: of the robot.
        setup: what they know.
        simulated: the setup that moves; it may be another one, which stands in for it.
    """

    def connect(seed: int, pace: float, folder: Path) -> RobotDriver:
        return RehearsalRobot(name, replace(setups.load(simulated), name=setup), seed, pace, folder)

    return Robot(name, setup, connect, simulated=True)


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
