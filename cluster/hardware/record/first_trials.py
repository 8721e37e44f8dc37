"""The first trials of a campaign, shared with another one of the same robot: imported, nothing moves."""

import hashlib
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from cluster.errors import UsageError
from cluster.hardware.events import canonical
from cluster.hardware.record import opening
from cluster.hardware.states import IMPORTED, State

KINDS = ("random", IMPORTED)


@dataclass(frozen=True)
class FirstTrial:
    """One trial that another campaign measured.

    Attributes:
        campaign: name of the other campaign.
        number: of the trial there.
        x_hex: controller as little-endian float64 in hexadecimal.
        f: objective.
        y: badness in [0, 1].
    """

    campaign: str
    number: int
    x_hex: str
    f: float
    y: float

    @property
    def x(self) -> np.ndarray:
        """The controller, [D], float64."""
        return np.frombuffer(bytes.fromhex(self.x_hex), dtype="<f8").astype(np.float64)


def digest(trials: tuple[FirstTrial, ...]) -> str:
    """SHA-256 of shared trials, which is part of a campaign's identity; "" for none."""
    if not trials:
        return ""
    return hashlib.sha256(canonical({"trials": [asdict(each) for each in trials]}).encode()).hexdigest()


def first_trials(folder: Path, robot: str, count: int) -> tuple[FirstTrial, ...]:
    """The measured first trials of the campaign in a folder.

    Args:
        folder: of that campaign.
        robot: that the trials must have been measured on.
        count: how many are needed.

    Returns:
        Its first random trials, or those that it shares with yet another campaign.

    Raises:
        UsageError: it is of another robot, or has too few.
        JournalError: there is no campaign, or its journal is damaged.
    """
    with opening.to_read(folder) as journal:
        if journal.identity.robot != robot:
            raise UsageError(
                f"{folder} holds trials of {journal.identity.robot!r}, and this campaign is on {robot!r}: "
                "share those of the same robot"
            )
        measured = [
            FirstTrial(journal.name, trial.number, trial.x_hex, *trial.measurement)
            for trial in journal.trials()
            if trial.state is State.MEASURED and trial.kind in KINDS
        ]
    if len(measured) < count:
        raise UsageError(
            f"{folder} has {len(measured)} first trials that were measured, and {count} are to be shared: "
            "let that campaign measure them first"
        )
    return tuple(measured[:count])
