"""The one place at a robot: one campaign at a time, handed on between trials when its driver is gone."""

from time import monotonic

from cluster.errors import UserError
from cluster.hardware.executor import Executor
from cluster.hardware.plan import CampaignPlan
from cluster.hardware.status import Status

IDLE_SECONDS = 60.0
"""A driver asks for the next trial within this; one that does not has died and lost the robot."""


class RobotBusy(UserError):  # noqa: N818 - names the state of the robot
    """Another campaign holds the robot."""


class Station:
    """The one place at a robot: one campaign at a time, handed on between trials when its driver is gone."""

    def __init__(self) -> None:
        self._executor: Executor | None = None
        self._asked = monotonic()

    def enter(self, plan: CampaignPlan) -> Status:
        """Takes the place, or goes on with the same plan.

        Raises:
            RobotBusy: when another campaign's driver is at work here.
        """
        if self._executor is not None and not _is_same(self._executor.plan, plan):
            if monotonic() - self._asked < IDLE_SECONDS:
                raise RobotBusy(
                    f"robot {plan.identity.robot!r} is held by the campaign in {self._executor.plan.folder}; "
                    f"wait until it has ended, or {IDLE_SECONDS:.0f} s after its command was ended"
                )
            self.leave()
        self._executor = self._executor or Executor(plan)
        self._asked = monotonic()
        return self._executor.status()

    def advance(self, plan: CampaignPlan) -> Status:
        """Goes on with a campaign up to the end of one trial; see `Executor.advance`.

        Raises:
            RobotBusy: when the place has been handed on to another campaign.
        """
        if self._executor is None or not _is_same(self._executor.plan, plan):
            raise RobotBusy(
                f"the robot no longer serves the campaign in {plan.folder}; repeat the start command"
            )
        try:
            return self._executor.advance()
        finally:
            self._asked = monotonic()

    def withdraw(self, plan: CampaignPlan) -> bool:
        """Gives the place up unless another campaign has it; whether the place is empty then."""
        if self._executor is not None and not _is_same(self._executor.plan, plan):
            return False
        self.leave()
        return True

    def leave(self) -> None:
        """Gives the place up."""
        if self._executor is not None:
            self._executor.close()
        self._executor = None


def _is_same(one: CampaignPlan, other: CampaignPlan) -> bool:
    """Whether two plans mean the same campaign; its pace may differ."""
    return (one.identity, one.folder) == (other.identity, other.folder)
