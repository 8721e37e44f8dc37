"""What training processes report of their epochs, for the person who watches and for the MLflow run."""

from functools import partial
from typing import Any

from cluster.progress import ProgressLine, say
from cluster.tracking import Run
from cluster.tracking.recorder import PAUSE_SECONDS, Recorder

CONSEQUENCE = ". Training goes on; its curves are completed when the store is back"
"""A person reads this behind the store's error when the store fails meanwhile."""


class Reports:
    """Shows every report at once and records it; what a failing store misses is kept and recorded later.

    Args:
        progress: where updates are shown.
        run: the MLflow run.
        pause: seconds; see `Recorder`.
    """

    def __init__(self, progress: ProgressLine, run: Run, pause: float = PAUSE_SECONDS) -> None:
        self._progress, self._run = progress, run
        self._recorder = Recorder(CONSEQUENCE, pause)

    def receive(self, report: dict[str, Any]) -> None:
        """Show a report, and record all that are not yet recorded; a failing store ends nothing."""
        self._show(report)
        self._recorder.record(partial(self._record, report))

    def complete(self) -> None:
        """Record what is not yet recorded, in its order.

        Raises:
            UserError: the store still fails.
        """
        self._recorder.complete()

    def give_up(self) -> None:
        """Leave a store that has failed alone from now on: who has pressed Ctrl-C does not wait for it."""
        self._recorder.give_up()

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
