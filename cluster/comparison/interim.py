"""`svaedc compare --report`: what a comparison shows so far, from the trials that its folder holds."""

from typing import Any

from cluster.comparison.folder import PAGE
from cluster.comparison.missing import missing_runs
from cluster.comparison.plan import ComparisonPlan, run_parameters
from cluster.comparison.records import Runs
from cluster.comparison.report import document, lines, publish, summary_of
from cluster.errors import UserError
from cluster.progress import say
from svaedc.analysis.summary import Summary


def report(plan: ComparisonPlan) -> Summary:
    """Report what there is of a comparison, which may have been interrupted; runs and tracks nothing.

    Args:
        plan: what was asked for.

    Returns:
        Summary of the runs in its folder.

    Raises:
        UserError: the folder holds no trials, those of another comparison, or a command is at work in it.
    """
    folder, asked = plan.job.folder, plan.grid.keys()
    if not folder.path.exists() or not any(folder.runs().values()):
        raise UserError(f"{folder} holds no trials to report: run the same command without --report first")
    with folder.alone():
        parameters = {**plan.claim(), **plan.parameters}
        runs = {key: trials for key, trials in folder.runs().items() if trials}
        summary = summary_of(plan.job, plan.setup, comparable(runs, plan.job.length))
        settings = {**parameters, **run_parameters(runs)}
        publish(plan.job, plan.setup, runs, summary, settings, plan.caption, asked)
    for line in lines(summary):
        say(line)
    missing = missing_runs(asked, runs, plan.job.length)
    if missing.made:
        say(str(missing))
    say(f"{folder.path / PAGE}")
    return summary


def describe(plan: ComparisonPlan, summary: Summary) -> dict[str, Any]:
    """What a program is told of a comparison.

    Args:
        plan: what was asked for.
        summary: of the runs in its folder.

    Returns:
        What `summary.json` holds, with the folder.
    """
    missing = missing_runs(plan.grid.keys(), plan.job.folder.runs(), plan.job.length)
    content = document(plan.job, plan.setup, summary, missing, plan.caption)
    return {**content, "folder": str(plan.job.folder)}


def comparable(runs: Runs, length: int) -> Runs:
    """Cut runs to where they can be compared: while none is whole, to the trials that all of them have.

    Args:
        runs: that have begun.
        length: trials of a whole run.

    Returns:
        The runs as they are once one is whole.
    """
    lengths = [len(trials) for trials in runs.values()]
    if max(lengths) >= length:
        return runs
    return {key: trials[: min(lengths)] for key, trials in runs.items()}
