"""Where a robot's home is, and what its limits are."""

import json
import os
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from cluster.errors import UsageError, UserError
from cluster.files import write_json
from cluster.home import robot_folder
from workers.hardware.driver import RobotFault
from workers.hardware.gate import GateShut
from workers.host import durable
from workers.host.home import RobotHeld, RobotHome
from workers.host.ledger import LedgerDamaged
from workers.host.limits import RobotLimits

FILE: Final = "robot.json"
"""A campaign's folder says in it which home its robot has."""
ELSEWHERE: Final = "elsewhere.txt"
"""The usual home of a robot names in it the other homes that campaigns were begun with."""


@contextmanager
def robot_errors() -> Iterator[None]:
    """Turns what goes wrong at a robot into messages that say what to do.

    Raises:
        UserError: the robot is held or must not serve, its ledger is damaged, or its home cannot be used.
    """
    try:
        yield
    except RobotHeld as error:
        raise UserError(
            f"{error}: wait until it has ended, or end it; a robot serves one at a time"
        ) from error
    except (LedgerDamaged, GateShut, RobotFault) as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(
            f"cannot use {error.filename or 'the home of the robot'}: {error.strerror or error}; it needs a "
            "writable local disk with space left, and nothing is moved without it"
        ) from error


def home_of(robot: str, home: Path | None) -> RobotHome:
    """The home of a robot; nothing is created.

    Args:
        robot: its name.
        home: folder that a person named; None for the usual one.

    Returns:
        The home.

    Raises:
        UsageError: nobody knows where the user's home is.
    """
    try:
        return RobotHome((home or robot_folder(robot)).absolute(), robot)
    except ValueError as error:
        raise UsageError(f"{error}; or name the robot's home with --home") from error


def enter(folder: Path, robot: str, home: Path | None) -> RobotHome:
    """Make a robot's home for a campaign, and let the campaign's folder remember where it is.

    Args:
        folder: of the campaign.
        robot: its name.
        home: folder that a person named; None for the one that the campaign was begun with, or the usual one.

    Returns:
        The home.

    Raises:
        UsageError: nobody knows where the user's home is.
        UserError: it cannot be made.
    """
    found = home_of_campaign(folder, robot, home)
    with robot_errors():
        found.make()
        _note_elsewhere(found)
        write_json(folder / FILE, {"robot": robot, "home": os.fspath(found.path)})
    return found


def home_of_campaign(folder: Path, robot: str, home: Path | None = None) -> RobotHome:
    """The home of a campaign's robot; nothing is created.

    Args:
        folder: of the campaign.
        robot: its name.
        home: folder that a person named; None for the one that the campaign was begun with, or the usual one.

    Returns:
        The home.

    Raises:
        UsageError: nobody knows where the user's home is.
    """
    return home_of(robot, home or _remembered_home(folder))


def limits_of(home: RobotHome, simulated: bool) -> RobotLimits:  # noqa: FBT001 - a fact of the robot, no switch
    """The limits of a robot.

    Args:
        home: of the robot.
        simulated: whether it is a stand-in, which may go without.

    Returns:
        What its `limits.toml` says.

    Raises:
        UserError: there is none, or it cannot be read.
    """
    try:
        with home.limits.open("rb") as file:
            return RobotLimits.read(tomllib.load(file), str(home.limits))
    except FileNotFoundError:
        if simulated:
            return RobotLimits()
        raise UserError(
            f"the robot {home.robot} has no limits, and does not move without: write {home.limits} "
            "(docs/how-to/hardware.md shows one)"
        ) from None
    except (ValueError, OSError) as error:
        raise UserError(f"cannot use the limits of {home.robot}: {error}") from error


def homes_of(robot: str, home: Path | None) -> tuple[RobotHome, ...]:
    """Every home that a robot has on this machine, as far as this user's campaigns know.

    Args:
        robot: its name.
        home: folder that a person named; None for the usual one and all that campaigns were begun with.

    Returns:
        Those whose folder exists.

    Raises:
        UsageError: nobody knows where the user's home is.
    """
    first = home_of(robot, home)
    others = [RobotHome(path, robot) for path in _elsewhere(first)] if home is None else []
    return tuple(each for each in (first, *others) if each.path.is_dir())


def _note_elsewhere(found: RobotHome) -> None:
    """Let a stop that names the robot alone find a home that a person chose."""
    with suppress(UserError, OSError):  # nobody's home is known, or it cannot be written: --home finds it
        usual = home_of(found.robot, None)
        if found.path not in (usual.path, *_elsewhere(usual)):
            usual.make()
            durable.append(usual.path / ELSEWHERE, os.fsencode(found.path) + b"\n")


def _elsewhere(usual: RobotHome) -> list[Path]:
    try:
        lines = (usual.path / ELSEWHERE).read_bytes().splitlines()
    except OSError:
        return []
    return [Path(os.fsdecode(line)) for line in lines if line]


def _remembered_home(folder: Path) -> Path | None:
    try:
        return Path(json.loads((folder / FILE).read_bytes())["home"])
    except (OSError, ValueError, KeyError, TypeError):
        return None
