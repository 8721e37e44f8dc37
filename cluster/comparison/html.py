"""A comparison as one HTML file that opens anywhere: figures, tables, settings, fingerprints."""

import math
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from svaedc.analysis.statistics import Estimate
from svaedc.analysis.summary import Difference, MethodSummary, Summary

_STYLE = """
body { font: 15px/1.5 system-ui, sans-serif; max-width: 72rem; margin: 2rem auto; padding: 0 1rem }
h1 { font-size: 1.5rem } h2 { font-size: 1.15rem; margin-top: 2.2rem }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; font-size: 13px }
th, td { padding: .25rem .7rem; text-align: right; border-bottom: 1px solid #ddd; white-space: nowrap }
th:first-child, td:first-child { text-align: left } img { max-width: 100% }
.scroll { overflow-x: auto } .note { background: #fff3cd; padding: .5rem .8rem } details { margin: .4rem 0 }
"""
_MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png"}


def page(
    title: str, summary: Summary, figures: Sequence[Path], initial: int, settings: Mapping[str, Any]
) -> str:
    """Compose the whole page; it loads nothing from elsewhere and runs no script.

    Args:
        title: what was compared.
        summary: the numbers, all of them computed before.
        figures: files to embed.
        initial: shared random trials.
        settings: what the comparison was made with, fingerprints included.

    Returns:
        The page as HTML.
    """
    after = checkpoints(summary, initial)
    parts = [
        f"<h1>{escape(title)}</h1>",
        _about(summary, initial),
        *(_image(path) for path in figures),
        "<h2>Methods</h2>",
        _table(_method_header(after, initial), _method_rows(summary, after)),
        "<h2>Paired differences on shared seeds</h2>",
        "<p>Method minus baseline: mean, 90 % bootstrap interval, and p of a two-sided sign-flip test after "
        "Holm's correction for the number of baselines of that method at that trial.</p>",
        *_differences(summary, after, initial),
        "<h2>Settings and fingerprints</h2>",
        _table(("setting", "value"), ((name, str(value)) for name, value in settings.items())),
    ]
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><title>{escape(title)}</title>'
        f"<style>{_STYLE}</style></head><body>\n" + "\n".join(parts) + "\n</body></html>\n"
    )


def checkpoints(summary: Summary, initial: int) -> list[int]:
    """Choose the trials that the tables show.

    Args:
        summary: of the comparison.
        initial: shared random trials.

    Returns:
        Their indices, counted from 0, in order: of the 10th and 20th suggested trials, where runs have so
        many, and of the last trial.
    """
    wanted = {initial + 9, initial + 19, summary.trials - 1}
    return sorted(index for index in wanted if index < summary.trials)


def _about(summary: Summary, initial: int) -> str:
    tuning = "These runs have tuning seeds: they are for choosing settings, and their numbers are no results."
    notes = [tuning] if summary.purpose != "reporting" else []
    return (
        "".join(f'<p class="note">{note}</p>' for note in (*notes, *_remarks(summary)))
        + f"<p>Every run has {summary.trials} trials: {initial} random ones, shared by all methods of a "
        "seed together with the hidden physics, then those the method suggested. Intervals are 90 %, "
        "over complete runs.</p>"
    )


def _remarks(summary: Summary) -> Iterable[str]:
    """What a reader would otherwise wonder about."""
    ran = [method for method in summary.methods.values() if method.runs]
    if ran and not any(method.first_success.reached for method in ran):
        yield "Nobody reached the threshold of success: no run of any method succeeded in any trial."
    if any(method.failed_trials.mean > 0 for method in ran):
        yield (
            "Some trials gave no objective. They teach no method anything, are not tried again, and enter no "
            "mean; the last column has their share."
        )


def _image(path: Path) -> str:
    data = b64encode(path.read_bytes()).decode()
    return f'<p><img alt="{escape(path.stem)}" src="data:{_MEDIA_TYPES[path.suffix]};base64,{data}"></p>'


def _method_header(after: Sequence[int], initial: int) -> list[str]:
    return [
        *("method", "runs", "incomplete"),
        *(f"best after {index + 1 - initial} suggested" for index in after),
        *("mean objective", "runs with success", "trials to success, median", "broken", "no objective"),
    ]


def _method_rows(summary: Summary, after: Sequence[int]) -> Iterable[list[str]]:
    def order(name: str) -> float:
        best = summary.methods[name].best[-1].mean
        return math.inf if math.isnan(best) else -best

    for name in sorted(summary.methods, key=order):
        method = summary.methods[name]
        yield [
            *(name, str(method.runs), str(method.incomplete)),
            *(_estimate(method.best[index]) for index in after),
            *(_estimate(method.objective), _share(method.successful_runs), _until_success(method)),
            *(_share(method.broken_trials), _share(method.failed_trials)),
        ]


def _until_success(method: MethodSummary) -> str:
    found = method.first_success
    median = "not reached" if math.isnan(found.median) else f"{found.median:g}"
    return f"{median} ({found.reached} of {method.runs} runs)"


def _differences(summary: Summary, after: Sequence[int], initial: int) -> Iterable[str]:
    header = ["baseline", "runs"]
    for index in after:
        header += [f"best after {index + 1 - initial} suggested", "p"]
    for name in summary.methods:
        rows = [_difference(each, after) for each in summary.differences if each.method == name]
        if rows:
            table = _table([*header, "mean objective", "p"], rows)
            yield f"<details><summary>{escape(name)} against every other</summary>{table}</details>"


def _difference(each: Difference, after: Sequence[int]) -> list[str]:
    cells = [each.baseline, str(each.runs)]
    for index in after:
        cells += [_estimate(each.best[index]), _p(each.p_best[index])]
    return [*cells, _estimate(each.objective), _p(each.p_objective)]


def _table(header: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>\n" for row in rows)
    return f'<div class="scroll"><table><tr>{head}</tr>\n{body}</table></div>'


def _estimate(value: Estimate) -> str:
    if math.isnan(value.mean):
        return "–"
    interval = "" if math.isnan(value.low) else f" [{value.low:+.3f}, {value.high:+.3f}]"
    return f"{value.mean:+.3f}{interval}"


def _share(value: Estimate) -> str:
    return "–" if math.isnan(value.mean) else f"{value.mean:.0%}"


def _p(value: float) -> str:
    return "–" if math.isnan(value) else ("< 0.001" if value < 0.001 else f"{value:.3f}")
