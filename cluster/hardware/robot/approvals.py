"""What an approval is worth: it holds for a while, for these limits, and until a stop."""

import json
from collections.abc import Mapping
from datetime import datetime
from typing import Any

from cluster.hardware.events import Event


def lapse_of(approved: Event, bounds: Mapping[str, Any], now: datetime) -> str:
    """Say why an approval no longer holds.

    Args:
        approved: the event of the approval; its body may have `until`, a moment, and `limits`, a SHA-256.
        bounds: what holds now: `limits`, and `cleared`, when a stop last was.
        now: the present, in UTC.

    Returns:
        The reason; "" while it holds.
    """
    said = json.loads(approved.body)
    if said.get("until") and now >= datetime.fromisoformat(said["until"]):
        return f"the approval of {approved.who} held until {said['until']}"
    if said.get("limits", bounds["limits"]) != bounds["limits"]:
        return f"the robot's limits have changed since the approval of {approved.who}"
    if approved.at < bounds["cleared"]:
        return f"the robot was stopped since the approval of {approved.who}"
    return ""
