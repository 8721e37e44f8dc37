"""What a campaign asks of others: where its controllers come from, and the gate before its robot."""

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

import numpy as np

from cluster.hardware.status import RobotGate
from svaedc.bo.history import History
from workers.hardware.driver import Motion


@runtime_checkable
class Proposer(Protocol):
    """Where controllers come from; a pure function of the campaign's identity and its arguments."""

    def random(self, history: History, index: int) -> np.ndarray:
        """The random controller of one of the first trials.

        Args:
            history: what was tried.
            index: of the trial.

        Returns:
            A point of the unit cube, [D].
        """
        ...

    def suggest(self, history: History, index: int) -> np.ndarray:
        """The controller, [D], of a later trial.

        Args:
            history: what was measured.
            index: of the trial.

        Returns:
            A point of the unit cube.
        """
        ...

    def predict(self, x: np.ndarray) -> float | None:
        """Badness of a controller in [0, 1] as the model expects it; None without a model."""
        ...


@runtime_checkable
class CampaignGate(RobotGate, Protocol):
    """What must be true of the robot before a trial may move it; see `workers.hardware.gate.Gate`."""

    def grant(self, campaign: str, trial_id: str, journal: str) -> None:
        """Tell the robot's ledger which journal lets a trial move it.

        Args:
            campaign: its name.
            trial_id: of the trial.
            journal: hash of the event that granted it.
        """
        ...

    def motion(self, trial_id: str) -> Motion:
        """What the robot's ledger says of a trial."""
        ...

    def plan(self, trial_id: str, x: np.ndarray) -> Mapping[str, Any]:
        """Let the robot plan a controller; nothing moves.

        Args:
            trial_id: of the trial.
            x: the controller, [D], in [0, 1].

        Returns:
            What it will ask of the robot, with an `objection` where it must not run.
        """
        ...

    def approval(self) -> Mapping[str, Any]:
        """What an approval is bound to, besides the controller."""
        ...
