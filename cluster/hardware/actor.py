"""The one actor of a robot, and how Ray must run it."""

from typing import Any

import ray

from cluster.hardware.plan import CampaignPlan
from cluster.hardware.station import Station
from cluster.hardware.status import Status

RESOURCE = "hardware"
"""The robot's machine offers one of this resource: one campaign at a time has a place there."""

PREFIX = "hardware-"


class HardwareActor:
    """The Ray side of a `Station`; it decides nothing."""

    def __init__(self) -> None:
        self._station = Station()

    def enter(self, plan: CampaignPlan) -> Status:
        """See `Station.enter`."""
        return self._station.enter(plan)

    def advance(self, plan: CampaignPlan) -> Status:
        """See `Station.advance`."""
        return self._station.advance(plan)

    def withdraw(self, plan: CampaignPlan) -> None:
        """See `Station.withdraw`; ends the process when the place is empty then."""
        if self._station.withdraw(plan):
            ray.actor.exit_actor()


def actor_options(robot: str, namespace: str, lifetime: str) -> dict[str, Any]:
    """How the one actor of a robot must run: nothing Ray does may start a trial a second time.

    Args:
        robot: in the registry.
        namespace: that everybody who shares the robot uses.
        lifetime: "detached" where the cluster outlives the driver, so that a trial outlives it too.

    Returns:
        Keyword arguments for the `options` of the actor's class.
    """
    return {
        "name": f"{PREFIX}{robot}",
        "namespace": namespace,
        "lifetime": lifetime,
        "num_cpus": 0,
        "resources": {RESOURCE: 1},
        "max_concurrency": 1,
        "max_restarts": 0,
        "max_task_retries": 0,
    }
