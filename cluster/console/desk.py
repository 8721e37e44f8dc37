"""What lies on an operator's desk: one campaign, its robot, and everything that is known of both."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from cluster.hardware import journal, operator
from cluster.hardware.events import CampaignTrial, Event
from cluster.hardware.record import opening
from cluster.hardware.record.attachments import Attachment, attachments
from cluster.hardware.record.foresight import FOLDER as PREVIEWS
from cluster.hardware.record.rows import rows
from cluster.hardware.robot import residence
from cluster.hardware.states import TERMINAL
from cluster.hardware.status import Phase, Status
from workers.host import live
from workers.host.home import RobotHome

CLIPS: Final = {".gif": "image/gif", ".mp4": "video/mp4"}


@dataclass(frozen=True)
class View:
    """One look at everything.

    Attributes:
        status: of the campaign.
        rows: of its trials.
        events: of its journal.
        files: of its trials.
        stopped: why the robot is stopped; "" when it is not.
        holder: who has the robot, in words; "" for nobody.
        live: what is seen of the motion under way.
        mark: changes whenever a page that was made before is out of date.
    """

    status: Status
    rows: Sequence[Mapping[str, Any]]
    events: Sequence[Event]
    files: Sequence[Attachment]
    stopped: str
    holder: str
    live: Mapping[str, Any]
    mark: str

    @property
    def open_trial(self) -> CampaignTrial | None:
        """The trial that has not ended."""
        return next((trial for trial in self.status.trials if trial.state not in TERMINAL), None)

    @property
    def since(self) -> str:
        """When the campaign came to where it stands; "" before its first event."""
        return self.events[-1].at if self.events else ""

    @property
    def attendance(self) -> str:
        """Whether anything carries the campaign out, in a sentence."""
        if not self.holder:
            return "Nobody has the robot: the start command does not run."
        if self.holder.startswith(f"the campaign in {self.status.folder} "):
            return "The start command runs."
        return f"The robot is held by {self.holder}."

    def pulse(self) -> dict[str, Any]:
        """What open pages are told a few times a second: `mark`, `phase`, `stopped`, `live`."""
        phase = str(self.status.phase)
        return {"mark": self.mark, "phase": phase, "stopped": self.stopped, "live": dict(self.live)}

    def events_of(self, number: int) -> list[Event]:
        """Every event of a trial, oldest first."""
        return [event for event in self.events if event.trial == number]

    def files_of(self, number: int) -> list[Attachment]:
        """Every file of a trial."""
        return [each for each in self.files if each.trial == number]


@dataclass(frozen=True)
class Desk:
    """Where one campaign is looked at.

    Attributes:
        folder: of the campaign.
        home: of its robot.
    """

    folder: Path
    home: RobotHome

    @classmethod
    def of(cls, folder: Path) -> "Desk":
        """The desk of the campaign in a folder.

        Raises:
            JournalError: there is none, or its journal is damaged.
        """
        with opening.to_read(folder) as opened:
            robot = opened.identity.robot
        return cls(folder, residence.home_of_campaign(folder, robot))

    def look(self) -> View:
        """Everything, as it is now; nothing is written.

        Raises:
            UserError: something of it cannot be read, or is damaged.
        """
        with opening.to_read(self.folder) as opened:
            status = operator.status_of(self.folder, opened)
            found, events = rows(opened), opened.events()
        stopped = str(self.home.latch.read() or "")
        mark = f"{len(events)} {status.phase} {bool(stopped)}"
        files, holder = attachments(self.folder), self.home.holder()
        seen = self._live_motion(status)
        return View(status, found, events, files, stopped, holder, seen, mark)

    def look_again(self, view: View) -> View:
        """The same, where nothing has changed but the motion under way."""
        return replace(view, live=self._live_motion(view.status))

    def signature(self) -> tuple[int, ...]:
        """Changes when anything has but the motion under way; cheap enough to be asked for all the time."""
        files = (self.folder / journal.FILE, self.folder / f"{journal.FILE}-wal", self.home.latch.path)
        return tuple(_change_of(path) for path in files)

    def clip(self, number: int) -> Path | None:
        """The drawing of a trial's first simulation; None where there is none."""
        paths = (self.folder / PREVIEWS / f"trial-{number:03d}{suffix}" for suffix in CLIPS)
        return next((path for path in paths if path.is_file()), None)

    def attachment(self, sha256: str) -> tuple[Path, Attachment] | None:
        """A file of the campaign by its hash, and what is known of it; None where there is none."""
        found = next((each for each in attachments(self.folder) if each.sha256 == sha256), None)
        return (self.folder / found.file, found) if found else None

    def _live_motion(self, status: Status) -> dict[str, Any]:
        """What the host tells of a motion, if it is this campaign's and not over."""
        if status.phase is not Phase.RUNNING:
            return {}
        seen = live.read(self.home.live)
        number = next((trial.number for trial in status.trials if trial.state not in TERMINAL), None)
        return seen if seen.get("trial") == f"{status.name}-{number:03d}" else {}


def _change_of(path: Path) -> int:
    try:
        return os.stat(path).st_mtime_ns  # noqa: PTH116 - of many files, many times
    except OSError:
        return 0
