"""What a robot's ledger says of trials."""

from collections.abc import Mapping
from typing import Any

from workers.hardware.driver import Measurement, Motion
from workers.host.ledger import CUT, Ledger
from workers.host.serve import BROKEN, ENDED, STARTED


def motion_in(ledger: Ledger, trial_id: str) -> Motion:
    """What a robot's ledger says of one trial.

    Args:
        ledger: of the robot.
        trial_id: of the trial.

    Returns:
        Whether it moved the robot, and what it measured; not certain where a line that was cut off since the
        trial was granted may have been its start.
    """
    started, measured, certain = False, None, True
    for entry in ledger.entries():
        if entry.event == CUT:
            certain = False
        if entry.facts.get("trial") != trial_id:
            continue
        if entry.event not in (STARTED, ENDED, BROKEN):
            certain = True  # it was granted here, so that its start can only come later
            continue
        started = True
        if entry.event == ENDED:
            measured = measurement_of(entry.facts["measurement"], 0.0)
    return Motion(started, measured, started or (certain and not ledger.is_cut))


def measurement_of(facts: Mapping[str, Any], seconds: float) -> Measurement:
    """The measurement in an answer of a host, or in a line of a ledger.

    Args:
        facts: plain values.
        seconds: duration of the trial, where they do not say it.

    Returns:
        The measurement.

    Raises:
        ValueError: they are no measurement.
    """
    return Measurement(
        f=float(facts["f"]),
        y=float(facts["y"]),
        stop=str(facts.get("stop", "")),
        seconds=float(facts.get("seconds", seconds)),
        evidence=str(facts["evidence"]),
    )
