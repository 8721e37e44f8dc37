"""What people read of a comparison: a table, a summary and a figure."""

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

from cluster import files
from cluster.comparison import figure
from cluster.comparison.folder import FIGURE, PAGE, SUMMARY
from cluster.comparison.html import page
from cluster.comparison.records import Runs, rows
from cluster.comparison.worker import ComparisonJob
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.summary import Reporting, Summary
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
) -> Report:
    """Write what people read; each file is whole, or as it was before.

    Args:
        job: what all runs share.
        setup: whose objective was maximised.
        runs: all trials.
        summary: of them.
        settings: that the comparison was made with, for the page.
        caption: before the title of figure and page; "" for none.

    Returns:
        The files that were written.

    Raises:
        UserError: the disk is full.
    """
    folder, title = job.folder, _title(job, setup, caption)
    table = folder.write_table(runs, {"setup": job.setup, "gap": job.gap})
    written = folder.write(SUMMARY, json.dumps({"title": title, **summary.as_json()}, indent=2) + "\n")
    with files.writing(folder.path):
        drawn = figure.best_so_far(
            folder.path / FIGURE,
            summary,
            title=title,
            initial=job.initial,
            limits=setup.objective_limits,
        )
    versions = {f"version of {name}": version(name) for name in _VERSIONS}
    report = folder.write(PAGE, page(title, summary, drawn[1:], job.initial, {**settings, **versions}))
    return Report((table, written, report), drawn)


def _title(job: ComparisonJob, setup: Setup, caption: str) -> str:
    """What was compared; a stand-in for hardware is called one, and a formula has no physics to hide."""
    name = f"{job.setup}, a {robots.STAND_IN}" if robots.stands_in_for(job.setup) else job.setup
    before = f"{caption}\n" if caption else ""
    physics = f" under hidden physics ({job.gap} gap)" if setup.gap(job.gap).intervals else ""
    return f"{before}{name}: Bayesian optimisation{physics}"


def lines(summary: Summary) -> Iterator[str]:
    """A line about every method."""
    for name, method in summary.methods.items():
        if not method.runs:
            yield f"{name:>18}: no run has all {summary.trials} trials yet"
            continue
        best, broken = method.best[-1], method.broken_trials.mean
        trouble = "" if math.isnan(broken) else f"broken {broken:.0%}, "
        yield (
            f"{name:>18}: best after {summary.trials} trials {best.mean:+.2f} "
            f"[{best.low:+.2f}, {best.high:+.2f}], mean objective of its trials "
            f"{method.objective.mean:+.2f}, {trouble}{method.runs} runs"
        )
