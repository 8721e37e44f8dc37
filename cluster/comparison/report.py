"""What people and programs read of a comparison: a table, a summary, a figure, a page, lines."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from cluster import files
from cluster.comparison import figure
from cluster.comparison.folder import FIGURE, PAGE, SUMMARY
from cluster.comparison.html import page
from cluster.comparison.missing import MissingRuns, missing_runs
from cluster.comparison.records import RunKey, Runs, rows
from cluster.comparison.worker import ComparisonJob
from svaedc.analysis.aggregation import best_of_runs, summarize
from svaedc.analysis.statistics import Estimate
from svaedc.analysis.summary import MethodSummary, Reporting, Summary
from svaedc.analysis.verdict import judge, leader, sentences, verdict
from svaedc.analysis.words import quantity
from workers.hardware import robots
from workers.randomness import Stream, generator
from workers.setups import Setup

_VERSIONS = ("svaedc", "torch", "gpytorch", "botorch", "numpy", "pybullet", "ray")


@dataclass(frozen=True)
class Report:
    """The files that were written."""

    files: tuple[Path, ...]
    figures: tuple[Path, ...]


def summary_of(job: ComparisonJob, setup: Setup, runs: Runs) -> Summary:
    """Summarise all runs of the folder; the same runs give the same numbers.

    Args:
        job: what all runs share.
        setup: whose objective was maximised; it says which trials count as broken.
        runs: all trials.

    Returns:
        Means, intervals and paired differences.
    """
    reporting = Reporting(initial=job.initial, broken_below=setup.broken)
    return summarize(rows(runs), reporting, generator(0, Stream.BOOTSTRAP, 0))


def publish(
    job: ComparisonJob,
    setup: Setup,
    runs: Runs,
    summary: Summary,
    settings: Mapping[str, Any],
    caption: str = "",
    asked: Iterable[RunKey] = (),
) -> Report:
    """Write what people read; each file is whole, or as it was before.

    Args:
        job: what all runs share.
        setup: whose objective was maximised.
        runs: all trials.
        summary: of them.
        settings: that the comparison was made with, for the page.
        caption: before the title of figure and page; "" for none.
        asked: the runs that were asked for; without any, those that there are.

    Returns:
        The files that were written.

    Raises:
        UserError: the disk is full.
    """
    folder, title = job.folder, _title(job, setup, caption)
    missing = missing_runs(tuple(asked) or runs, runs, job.length)
    table = folder.write_table(runs, {"setup": job.setup, "gap": job.gap})
    content = document(job, setup, summary, missing, caption)
    written = folder.write(SUMMARY, files.json_text(content) + "\n")
    with files.writing(folder.path):
        drawn = figure.best_so_far(
            folder.path / FIGURE,
            summary,
            best_of_runs(row for row in rows(runs) if row.trial < summary.trials),
            title=title,
            initial=job.initial,
            limits=setup.objective_limits,
        )
    versions = {f"version of {name}": version(name) for name in _VERSIONS}
    text = page(title, summary, drawn[1:], job.initial, {**settings, **versions}, str(missing))
    return Report((table, written, folder.write(PAGE, text)), drawn)


def document(
    job: ComparisonJob, setup: Setup, summary: Summary, missing: MissingRuns, caption: str = ""
) -> dict[str, Any]:
    """All that is said of a comparison as plain values, for `summary.json` and `--json`.

    Args:
        job: what all runs share.
        setup: whose objective was maximised.
        summary: of the runs.
        missing: of the runs asked for.
        caption: before the title; "" for none.

    Returns:
        The summary by name, with its verdict and what it lacks.
    """
    first, plain = leader(summary), summary.as_json()
    judgements = [judge(summary, each) for each in summary.differences]
    return {
        "title": _title(job, setup, caption),
        "setup": job.setup,
        "gap": job.gap,
        "initial_trials": job.initial,
        "verdict": verdict(summary),
        "pairs": list(sentences(summary, first)) if first else [],
        "missing": missing.as_json(),
        **plain,
        "differences": [
            {**each, "judgement": judgement}
            for each, judgement in zip(plain["differences"], judgements, strict=True)
        ],
    }


def _title(job: ComparisonJob, setup: Setup, caption: str) -> str:
    """What was compared; a stand-in for hardware is called one, and a formula has no physics to hide."""
    name = f"{job.setup}, a {robots.STAND_IN}" if robots.stands_in_for(job.setup) else job.setup
    before = f"{caption}\n" if caption else ""
    physics = f" under hidden physics ({job.gap} gap)" if setup.gap(job.gap).intervals else ""
    return f"{before}{name}: Bayesian optimisation{physics}"


def lines(summary: Summary) -> Iterator[str]:
    """A line about every method, and the verdict."""
    for name, method in summary.methods.items():
        yield f"{name:>18}: {', '.join(_facts(method, summary.trials))}"
    yield verdict(summary)


def _facts(method: MethodSummary, trials: int) -> Iterator[str]:
    """What a line says of a method, in parts."""
    best, objective, broken = method.best[-1], method.objective.mean, method.broken_trials.mean
    if not method.runs:
        yield f"no run has all {quantity(trials, 'trial')} yet"
    elif math.isnan(best.mean):
        yield f"no objective after {quantity(trials, 'trial')}"
    else:
        yield f"best after {quantity(trials, 'trial')} {_estimate(best)}"
    if not math.isnan(objective):
        yield f"mean objective of its trials {objective:+.2f}"
    if not math.isnan(broken):
        yield f"broken {broken:.0%}"
    if method.failed:
        yield f"{method.failed} of {quantity(method.tried, 'trial')} failed"
    if method.runs:
        yield quantity(method.runs, "run")
    if method.incomplete:
        yield f"{quantity(method.incomplete, 'run')} not whole"


def _estimate(value: Estimate) -> str:
    """A number, with its interval where there is one."""
    interval = "" if math.isnan(value.low) else f" [{value.low:+.2f}, {value.high:+.2f}]"
    return f"{value.mean:+.2f}{interval}"
