"""`svaedc hardware robot`: what is true of a robot, whatever campaigns there are."""

from collections.abc import Iterator
from pathlib import Path

from cluster.errors import UserError
from cluster.hardware.events import moment_in_words, utc_now
from cluster.hardware.robot.residence import homes_of, robot_errors
from workers.hardware.gate import Gate
from workers.hardware.wear import wear
from workers.host.home import RobotHome
from workers.host.limits import RobotLimits
from workers.host.serve import STARTED


def account(robot: str, home: Path | None) -> Iterator[str]:
    """Tell of every home that a robot has here.

    Args:
        robot: its name.
        home: folder that a person named; None for every home that it has here.

    Yields:
        Lines.

    Raises:
        UserError: it has none, or its ledger is damaged.
    """
    homes = homes_of(robot, home)
    if not homes:
        raise UserError(f"no campaign of {robot!r} was ever begun here; `svaedc robots` lists what there is")
    with robot_errors():
        for each in homes:
            yield from _lines(each)


def _lines(home: RobotHome) -> Iterator[str]:
    entries = home.ledger.entries()
    worn, gate = wear(entries), Gate(home, RobotLimits(), home.path)
    yield f"{home.robot}: its home is {home.path}"
    yield f"  held by {home.holder() or 'nobody'}"
    yield f"  {gate.stopped or 'not stopped'}"
    yield f"  limits: {home.limits if home.limits.is_file() else 'none'}"
    broken = f", {worn.broken} of which broke off" if worn.broken else ""
    moved = f"{worn.commands} commands in {worn.seconds:.1f} s of motion"
    yield f"  moved by {worn.trials} trials{broken}: {moved}"
    if worn.trials:
        last = max(entry.at for entry in entries if entry.event == STARTED)
        yield f"  last at {moment_in_words(last)} UTC; it is {utc_now():%Y-%m-%d %H:%M} now"
    for name, distance in worn.travel.items():
        yield f"    {name:<20} sent over {distance:10.2f} in all"
