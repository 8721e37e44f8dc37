"""The robots known by name."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType

from workers import setups
from workers.hardware.driver import RobotDriver
from workers.hardware.rehearsal import RehearsalRobot

STAND_IN = "simulated stand-in"
"""These words stand wherever the result of one does, so that nobody takes it for a robot's."""


@dataclass(frozen=True)
class Robot:
    """What is known of a robot before it is connected.

    Attributes:
        name: in the registry.
        setup: name of the setup it realises.
        connect: (seed, pace in s, folder for its ledger) -> the driver.
    """

    name: str
    setup: str
    connect: Callable[[int, float, Path], RobotDriver]


def _rehearsal(name: str, setup: str) -> Robot:
    """The robot simulated by the setup of its own name, for models and methods that know only `setup`."""

    def connect(seed: int, pace: float, folder: Path) -> RobotDriver:
        return RehearsalRobot(name, replace(setups.load(name), name=setup), seed, pace, folder)

    return Robot(name, setup, connect)


ROBOTS: Mapping[str, Robot] = MappingProxyType(
    {
        robot.name: robot
        for robot in (
            _rehearsal("franka-rehearsal", "franka"),
            _rehearsal("yumi-rehearsal", "yumi"),
            _rehearsal("daisy-11d-rehearsal", "daisy-11d"),
        )
    }
)


def find(name: str) -> Robot:
    """The robot of that name.

    Raises:
        LookupError: when there is none; the message names the nearest.
    """
    return ROBOTS[setups.require_known(name, "robot", ROBOTS)]


def stands_in_for(setup: str) -> str:
    """The setup whose data and models a stand-in of that name works with; "" for every other setup."""
    return ROBOTS[setup].setup if setup in ROBOTS else ""
