"""What MLflow has of a comparison, noted in its folder, so that an interruption loses and repeats nothing."""

import json
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from functools import partial
from typing import Any

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey
from cluster.comparison.report import Report
from cluster.files import json_text
from cluster.tracking import Run, Tracker
from cluster.tracking.recorder import Recorder
from svaedc.bo.loop import Trial

NOTE = "mlflow.json"
CONSEQUENCE = ". The comparison goes on; what MLflow lacks is recorded at its end"
"""A person reads this behind the store's error when the store fails meanwhile."""


@dataclass(frozen=True)
class Note:
    """What MLflow has.

    Attributes:
        run: the newest parent run.
        parameters: its own; the same command goes on with it.
        children: runs that have a child run, with their number of trials.
        trials: in the table when the parent run was completed; 0 before.
    """

    run: str = ""
    parameters: Mapping[str, Any] = field(default_factory=dict)
    children: tuple[str, ...] = ()
    trials: int = 0


def note_in(folder: ComparisonFolder, tracker: Tracker) -> Note:
    """Read the note of a folder.

    One that is damaged, or speaks of another store, counts for nothing: MLflow then gets everything again.

    Args:
        folder: of the comparison.
        tracker: of the store that the note must speak of.

    Returns:
        The note; an empty one where none counts.
    """
    with suppress(FileNotFoundError, ValueError, TypeError, KeyError):
        content = json.loads((folder.path / NOTE).read_text(encoding="utf-8"))
        note = Note(**{**content, "children": tuple(content["children"])})
        if tracker.holds(note.run):
            return note
    return Note()


def begin(
    folder: ComparisonFolder, tracker: Tracker, name: str, parameters: Mapping[str, Any]
) -> "TrackedComparison":
    """Go on with the run that an interrupted command of the same parameters began, or start one.

    Args:
        folder: of the comparison.
        tracker: that records it.
        name: of a new run.
        parameters: identity of the comparison and what the command asks for, by name.

    Returns:
        The parent run, which the note of the folder now names.
    """
    note = note_in(folder, tracker)
    if note.run and note.parameters == parameters and not note.trials:
        return TrackedComparison(folder, note, tracker.resume(note.run))
    run = tracker.run(name, "compare", parameters)
    return TrackedComparison(folder, replace(note, run=run.id, parameters=parameters, trials=0), run)


class TrackedComparison:
    """The parent run of one command, with a child run for every run of the comparison that is whole."""

    def __init__(self, folder: ComparisonFolder, note: Note, run: Run) -> None:
        self._folder = folder
        self._note = note
        self._recorder = Recorder(CONSEQUENCE)
        self.run = run
        self._save()

    def try_child(self, key: RunKey, trials: list[Trial]) -> None:
        """Record a run that has just ended, now or later; a store that fails stops no comparison.

        Args:
            key: of the run.
            trials: all of its trials.
        """
        self._recorder.record(partial(self.child, key, trials))

    def child(self, key: RunKey, trials: list[Trial]) -> None:
        """Record a run, unless MLflow has it.

        Args:
            key: of the run.
            trials: all of its trials.

        Raises:
            UserError: the store cannot be written.
        """
        name = f"{key}: {len(trials)} trials"
        if name in self._note.children:
            return
        with self.run.child(str(key), {"method": key.method, "run": key.run}) as run:
            run.curves({name: [getattr(trial, name) for trial in trials] for name in ("f", "y", "best")})
        self._note = replace(self._note, children=(*self._note.children, name))
        self._save()

    def complete(self, report: Report, curves: Mapping[str, list[float]], trials: int) -> None:
        """Record the results of the whole comparison.

        Args:
            report: the files and figures to keep.
            curves: one value per trial of each, by name.
            trials: number of trials in the table.

        Raises:
            UserError: the store cannot be written.
        """
        for path in report.files:
            self.run.file(path)
        for path in report.figures:
            self.run.figure(path)
        self.run.curves(curves)
        self._note = replace(self._note, trials=trials)
        self._save()

    def _save(self) -> None:
        self._folder.write(NOTE, json_text(asdict(self._note)) + "\n")
