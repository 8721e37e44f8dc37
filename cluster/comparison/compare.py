"""`svaedc compare`: submit the missing runs of a plan to Ray Tune, gather their trials, record."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from cluster.comparison.folder import FIGURE, PAGE, SUMMARY, TABLE
from cluster.comparison.plan import ComparisonPlan, run_parameters
from cluster.comparison.records import RunKey, Runs
from cluster.comparison.report import lines, publish, summary_of
from cluster.comparison.tracking import Note, TrackedComparison, begin, note_in
from cluster.comparison.tune import BestSoFar, Watch, submit
from cluster.errors import UserError
from cluster.progress import ProgressLine, say
from cluster.runtime.session import Session
from cluster.tracking import Run, Tracker
from svaedc.analysis.summary import Summary


@dataclass(frozen=True)
class Comparison:
    """What a comparison ends with.

    Attributes:
        summary: of every run in its folder.
        url: of its MLflow run.
    """

    summary: Summary
    url: str


def compare(plan: ComparisonPlan, session: Session, tracker: Tracker) -> Comparison:
    """Run what is missing of a comparison, then summarize all of it.

    Args:
        plan: what it compares.
        session: where it runs.
        tracker: that records it.

    Returns:
        Summary of all runs in the folder, and the address of the MLflow run.

    Raises:
        UserError: the folder holds another comparison or cannot be written, MLflow lacks some of the results,
            or runs kept failing; the report of all others is written first.
    """
    folder = plan.job.folder
    session.preflight(plan.slots)
    with folder.alone():
        parameters = {**plan.claim(), **plan.parameters}
        note, runs = note_in(folder, tracker), folder.runs()
        plan.require_length(runs)
        if _is_finished(plan, note, runs):
            say(f"{folder} holds the whole comparison: nothing to do")
            return Comparison(summary_of(plan.job, plan.setup, runs), Run(tracker, note.run).url)
        tracked = begin(folder, tracker, f"compare {plan.setup.name}", parameters)
        with tracked.run:
            failure = _submit(plan, tracked, runs)
            summary = _record(plan, tracked, parameters)
            if failure is not None:
                raise failure
            return Comparison(summary, tracked.run.url)


def _is_finished(plan: ComparisonPlan, note: Note, runs: Runs) -> bool:
    """Whether all runs asked for are whole, and both the folder and MLflow have the results of all trials."""
    whole = not plan.missing(runs) and note.trials == sum(map(len, runs.values()))
    return whole and plan.job.folder.holds((TABLE, SUMMARY, FIGURE, PAGE))


def _submit(plan: ComparisonPlan, tracked: TrackedComparison, runs: Runs) -> UserError | None:
    """Run what is missing, and record every run that is whole; the error of runs that kept failing."""
    missing = plan.missing(runs)
    if not missing:
        return None

    def record_end(key: RunKey) -> None:
        trials = plan.job.folder.trials(key)
        if len(trials) >= plan.job.length:
            tracked.try_child(key, trials)

    keys, length = plan.grid.keys(), plan.job.length
    best = BestSoFar(plan.grid.methods, {key: runs[key][-1].best for key in keys if runs.get(key)})
    done = sum(min(len(runs.get(key, ())), length) for key in keys)
    with ProgressLine("trials", len(keys) * length, done) as progress:
        return submit(plan.job, missing, plan.slots, Watch(progress, best, record_end))


def _record(plan: ComparisonPlan, tracked: TrackedComparison, parameters: Mapping[str, Any]) -> Summary:
    """Summarise all runs of the folder, for people and for MLflow."""
    folder = plan.job.folder
    runs = folder.runs()
    summary = summary_of(plan.job, plan.setup, runs)
    settings = {**parameters, **run_parameters(runs), "MLflow run": tracked.run.url}
    report = publish(plan.job, plan.setup, runs, summary, settings, plan.caption)
    for line in lines(summary):
        say(line)
    for path in folder.failures()[:1]:
        say(f"trials failed; what the first of them failed of is in {path}")
    say(f"{folder.path / PAGE}; {tracked.run.url}")
    asked = set(plan.grid.keys())
    for key, trials in runs.items():
        if key in asked:
            tracked.child(key, trials)
    curves = {f"best/{name}": [best.mean for best in method.best] for name, method in summary.methods.items()}
    tracked.complete(report, curves, sum(map(len, runs.values())))
    return summary
