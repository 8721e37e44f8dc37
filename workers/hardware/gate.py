"""What must be true of a robot before a trial may move it, and what its ledger is told of that."""

from collections.abc import Collection, Iterator
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from workers.hardware import ledger as before
from workers.hardware.driver import Motion
from workers.hardware.hosted import HostedRobot
from workers.hardware.ledger import MotionLedger
from workers.hardware.records import motion_in
from workers.host.home import RobotHome
from workers.host.ledger import LedgerEntry
from workers.host.limits import RobotLimits
from workers.host.serve import STARTED

GRANTED, ADOPTED, CLEARED = "granted", "adopted", "cleared"
"""Events of the ledger: a campaign is about to use the robot; a person vouches for one; a stop is over."""


class GateShut(RuntimeError):  # noqa: N818 - names the state of the gate
    """The robot must not serve this campaign."""


@dataclass(frozen=True)
class Gate:
    """Stands between a campaign and its robot.

    Attributes:
        home: of the robot.
        limits: of the robot.
        folder: of the campaign.
        robot: behind the gate; None for who only looks.
    """

    home: RobotHome
    limits: RobotLimits
    folder: Path
    robot: HostedRobot | None = None

    def require(self, campaign: str, hashes: Collection[str], granted: bool) -> None:  # noqa: FBT001
        """Refuse a folder that is not the one the robot knows, and take in one that is new here.

        Args:
            campaign: its name.
            hashes: of all events of its journal.
            granted: whether the journal ever granted a trial.

        Raises:
            GateShut: the folder was copied, restored or rolled back, or comes from another robot's home.
        """
        known = [entry for entry in self._of(campaign) if entry.event == GRANTED]
        lost = [entry for entry in known if entry.facts["journal"] not in hashes]
        if lost:
            raise GateShut(self._older(lost[-1]))
        if known or not granted or any(entry.event == ADOPTED for entry in self._of(campaign)):
            return
        if not (self.folder / before.FILE).exists():  # campaigns of svaedc 0.1 kept their robot's ledger
            raise GateShut(
                f"the campaign in {self.folder} has moved a robot, and {self.home.path}, the home of "
                f"{self.home.robot}, knows nothing of it: name the home it was begun with (--home); or, if "
                "the robot has got this home since, let a person vouch for the campaign: "
                f"svaedc hardware adopt {self.folder} --who NAME"
            )
        self.adopt(campaign, "svaedc: its own record of starts is in its folder")

    def adopt(self, campaign: str, who: str) -> None:
        """Let a campaign that moved the robot under another home go on.

        Args:
            campaign: its name.
            who: vouches for it.
        """
        self.home.ledger.append(ADOPTED, {"campaign": campaign, "who": who})

    def grant(self, campaign: str, trial_id: str, journal: str) -> None:
        """Tell the ledger, before a trial moves the robot, which journal let it.

        Args:
            campaign: its name.
            trial_id: of the trial.
            journal: hash of the event that granted it.

        Raises:
            OSError: the disk takes no more; nothing moves then.
        """
        self.home.ledger.append(
            GRANTED,
            {"campaign": campaign, "trial": trial_id, "journal": journal, "limits": self.limits.sha256},
        )

    @property
    def stopped(self) -> str:
        """Why the robot is stopped; "" when it is not."""
        return str(self.home.latch.read() or "")

    def rest_seconds(self, now: datetime) -> float:
        """How long the robot must rest before its next trial, as its limits say.

        Args:
            now: the present, in UTC.

        Returns:
            0 where it may start.
        """
        starts = [
            datetime.fromisoformat(entry.at).timestamp()
            for entry in self.home.ledger.entries()
            if entry.event == STARTED
        ]
        return self.limits.wait_seconds(starts, now.timestamp())

    def motion(self, trial_id: str) -> Motion:
        """What is known of a trial, also from a campaign's own ledger of before."""
        found = motion_in(self.home.ledger, trial_id)
        old = MotionLedger(self.folder / before.FILE).motion(trial_id)
        return old if old.started else found

    def plan(self, trial_id: str, x: Float[np.ndarray, " D"]) -> dict[str, Any]:
        """What a controller will ask of the robot.

        Args:
            trial_id: of the trial.
            x: the controller, [D], in [0, 1].

        Returns:
            Plain values: `seconds`, `steps`, `channels` with their extremes, `objection`, why it must not
            run, or "", and `rest`, what the robot's motors do without commands.

        Raises:
            RobotFault: the process at the robot does not answer.
        """
        if self.robot is None:
            return {}
        return {**asdict(self.robot.check(trial_id, x)), "rest": dict(self.robot.hello["rest"])}

    def approval(self) -> dict[str, str]:
        """What an approval is bound to: `limits`, their SHA-256, and `cleared`, when a stop last was."""
        cleared = [entry.at for entry in self.home.ledger.entries() if entry.event == CLEARED]
        return {"limits": self.limits.sha256, "cleared": cleared[-1] if cleared else ""}

    def _of(self, campaign: str) -> Iterator[LedgerEntry]:
        return (entry for entry in self.home.ledger.entries() if entry.facts.get("campaign") == campaign)

    def _older(self, entry: LedgerEntry) -> str:
        return (
            f"the journal in {self.folder} is not the one that the robot {self.home.robot} knows: the "
            f"robot's ledger has trial {entry.facts['trial']} granted at {entry.at}, and this journal has "
            "never heard of that. The folder is a copy, or was restored or rolled back: what it would do now "
            "the robot may have done already. Go on in the folder that has that trial. If it is lost, begin "
            "a new campaign in another folder"
        )
