"""A robot on a desk with a known objective, and campaigns on it that processes carry out and die of.

Everything here is real but the robot's arm: the journal, the lock, the ledger, and the SIGKILL.
"""

import hashlib
import os
import signal
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path

import numpy as np

from cluster.hardware import campaign, journal
from cluster.hardware.campaign import Campaign
from cluster.hardware.identity import CampaignIdentity
from cluster.hardware.journal import Journal
from cluster.hardware.lock import FolderLock, Process
from cluster.hardware.states import Approval
from cluster.hardware.status import Phase
from workers.hardware.driver import Measurement, Motion, RobotFault
from workers.hardware.ledger import MotionLedger
from workers.randomness import Stream, generator

DIMENSIONS = 5
IDENTITY = CampaignIdentity("desk", "desk", "climb", 7, "", 10, 2, Approval.POLICY)
OPTIMUM = np.linspace(0.2, 0.8, DIMENSIONS)


def now() -> datetime:
    return datetime.now(UTC)


def objective(x: np.ndarray) -> float:
    """What the desk robot measures, known in closed form."""
    return float(-np.sum((x - OPTIMUM) ** 2))


def climb(history, rng):
    """A method that any change in history or generator sends elsewhere."""
    best = history.x[int(np.argmax(history.f))]
    step = rng.normal(scale=0.05 * (1.0 + abs(history.f.mean())), size=best.shape)
    return np.clip(best + step, 0.0, 1.0).astype(np.float32)


@dataclass
class Fuse:
    """Counts the points at which a process could die, and dies at one of them."""

    burns_at: int
    names: list[str] = field(default_factory=list)

    def point(self, name: str) -> None:
        self.names.append(name)
        if len(self.names) - 1 == self.burns_at:
            os.kill(os.getpid(), signal.SIGKILL)


class DeskRobot:
    """Measures `objective`; keeps a ledger as every robot does."""

    name = "desk"
    setup = "desk"

    def __init__(self, folder: Path, fuse: Fuse, pace: float = 0.0, faulty: frozenset[int] = frozenset()):
        self.ledger = MotionLedger(folder / "starts.jsonl")
        self._fuse = fuse
        self._pace = pace
        self._faulty = faulty

    def run(self, trial_id: str, x: np.ndarray) -> Measurement:
        self._fuse.point("before motion")
        self.ledger.start(trial_id, x)
        self._fuse.point("in motion")
        time.sleep(self._pace)
        if int(trial_id[-3:]) in self._faulty:
            raise RobotFault("a motor is hot")
        measurement = Measurement(objective(x), 0.25, "", self._pace, hashlib.sha256(x.tobytes()).hexdigest())
        self.ledger.end(trial_id, measurement)
        self._fuse.point("after motion")
        return measurement

    def stop(self) -> None:
        pass

    def motion(self, trial_id: str) -> Motion:
        return self.ledger.motion(trial_id)


class FusedJournal(Journal):
    """A journal around each of whose writes the process can die."""

    fuse = Fuse(-1)

    def record(self, number, new, who, body, idem):
        self.fuse.point(f"before {new}")
        event = super().record(number, new, who, body, idem)
        self.fuse.point(f"after {new}")
        return event


def opened(folder: Path) -> Journal:
    return Journal(folder / journal.FILE, now)


@dataclass
class DeskProposals:
    """Controllers of the desk robot, from a seed and a method without a model."""

    method: Callable[..., np.ndarray] = climb
    seed: int = IDENTITY.seed

    def random(self, _, index):
        return generator(self.seed, Stream.INITIAL, index).random(DIMENSIONS)

    def suggest(self, history, index):
        return self.method(history, generator(self.seed, Stream.SUGGESTION, index))

    def predict(self, _):
        return None


@dataclass
class DeskGate:
    """An open gate before the desk robot."""

    robot: DeskRobot
    stopped: str = ""
    rest: float = 0.0
    objection: str = ""
    bounds: dict = field(default_factory=lambda: {"limits": "l" * 64, "cleared": ""})
    granted: list[tuple[str, str, str]] = field(default_factory=list)

    def rest_seconds(self, now: datetime) -> float:
        assert now.tzinfo is UTC
        return self.rest

    def grant(self, campaign: str, trial_id: str, journal: str) -> None:
        self.granted.append((campaign, trial_id, journal))

    def motion(self, trial_id: str) -> Motion:
        return self.robot.motion(trial_id)

    def plan(self, trial_id: str, x: np.ndarray) -> dict:
        return {"objection": self.objection, "seconds": float(len(trial_id) * len(x))}

    def approval(self) -> dict[str, str]:
        return self.bounds


def campaign_on(opened_journal: Journal, robot: DeskRobot, suggest=climb, gate=None) -> Campaign:
    proposals = DeskProposals(suggest, opened_journal.identity.seed)
    process = asdict(Process.current())
    gate = gate or DeskGate(robot)
    return Campaign(opened_journal, robot, gate, proposals, DIMENSIONS, process, {"desk": "1"})


def carry_out(
    folder: Path,
    burns_at: int = -1,
    pace: float = 0.0,
    faulty: frozenset[int] = frozenset(),
    identity: CampaignIdentity = IDENTITY,
) -> tuple[Phase, list[str]]:
    """The start command without Ray: until the campaign is complete or a person must act."""
    fuse = Fuse(burns_at)
    with FolderLock(folder, patience=10.0):
        fuse.point("locked")
        journal.create(folder / journal.FILE, "desk-1", identity)
        fuse.point("created")
        with closing(FusedJournal(folder / journal.FILE, now)) as fused:
            fused.fuse = fuse
            robot = DeskRobot(folder, fuse, pace, faulty)
            phase = Phase.READY
            while phase is Phase.READY:
                phase = campaign.advance(campaign_on(fused, robot))
    return phase, fuse.names


def starts(folder: Path) -> list[str]:
    """Names of the trials that ever moved the robot, from its own ledger."""
    return [e["trial"] for e in MotionLedger(folder / "starts.jsonl").entries() if e["event"] == "started"]
