"""What training processes report of their epochs, for the person who watches and for the MLflow run."""

import math
import time
from collections import deque
from typing import Any

from cluster.errors import UserError
from cluster.progress import ProgressLine, say
from cluster.tracking import Run

PAUSE_SECONDS = 30.0
"""Half of the pause after the store's first failure: one request to a dead server lasts minutes."""


class Reports:
    """Shows every report at once and records it; what a failing store misses is kept and recorded later.

    Args:
        progress: where updates are shown.
        run: the MLflow run.
        pause: seconds; every failure of the store doubles them, and it is left alone for that long.
    """

    def __init__(self, progress: ProgressLine, run: Run, pause: float = PAUSE_SECONDS) -> None:
        self._progress, self._run, self._pause = progress, run, pause
        self._unrecorded: deque[dict[str, Any]] = deque()
        self._due = -math.inf
        self._has_failed = False

    def receive(self, report: dict[str, Any]) -> None:
        """Show a report and record all that are not yet recorded; a failure is said once and ends nothing."""
        self._show(report)
        self._unrecorded.append(report)
        if time.monotonic() < self._due:
            return
        try:
            self.complete()
        except UserError as error:
            if not self._has_failed:
                say(f"{error}. Training goes on; its curves are completed when the store is back")
            self._has_failed = True
            self._pause *= 2
            self._due = time.monotonic() + self._pause

    def complete(self) -> None:
        """Record what is not yet recorded, in its order.

        Raises:
            UserError: the store still fails.
        """
        while self._unrecorded:
            self._record(self._unrecorded[0])
            self._unrecorded.popleft()

    def give_up(self) -> None:
        """Leave a store that has failed alone from now on: who has pressed Ctrl-C does not wait for it."""
        if self._has_failed:
            self._due = math.inf

    def _show(self, report: dict[str, Any]) -> None:
        if "device" in report:
            say(f"training on {report['device']}")
            return
        metrics = report["metrics"]
        self._progress.advance(
            report["update"] - self._progress.done,
            f"{report['stage']}, error against the median: reconstructed {metrics['held_out/rec_norm']:.2f}, "
            f"generated {metrics['held_out/gen_norm']:.2f}",
        )

    def _record(self, report: dict[str, Any]) -> None:
        if "device" in report:
            self._run.tags({"svaedc.device": report["device"]})
        else:
            self._run.metrics(report["metrics"], step=report["update"])
