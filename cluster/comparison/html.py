"""A comparison as one HTML file that opens anywhere: figures, tables, settings, fingerprints."""

import math
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from svaedc.analysis.statistics import Estimate
from svaedc.analysis.summary import Difference, MethodSummary, Summary

TEMPLATE = "report.html.j2"
"""The page's words and looks; what is computed for it is below."""
_MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png"}
_TUNING = "These runs have tuning seeds: they are for choosing settings, and their numbers are no results."


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
    loader = PackageLoader("cluster.comparison", ".")
    environment = Environment(
        loader=loader, autoescape=True, undefined=StrictUndefined, keep_trailing_newline=True
    )
    return environment.get_template(TEMPLATE).render(
        title=title,
        notes=[*([_TUNING] if summary.purpose != "reporting" else []), *_remarks(summary)],
        trials=summary.trials,
        initial=initial,
        figures=[_image(path) for path in figures],
        methods={"header": _method_header(after, initial), "rows": list(_method_rows(summary, after))},
        differences={"header": _difference_header(after, initial), "rows": _differences(summary, after)},
        settings=list(settings.items()),
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


def _image(path: Path) -> dict[str, str]:
    data = b64encode(path.read_bytes()).decode()
    return {"name": path.stem, "type": _MEDIA_TYPES[path.suffix], "data": data}


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


def _difference_header(after: Sequence[int], initial: int) -> list[str]:
    header = ["baseline", "runs"]
    for index in after:
        header += [f"best after {index + 1 - initial} suggested", "p"]
    return [*header, "mean objective", "p"]


def _differences(summary: Summary, after: Sequence[int]) -> list[tuple[str, list[list[str]]]]:
    """The rows of each method that was compared with another."""
    tables = (
        (name, [_difference(each, after) for each in summary.differences if each.method == name])
        for name in summary.methods
    )
    return [(name, rows) for name, rows in tables if rows]


def _difference(each: Difference, after: Sequence[int]) -> list[str]:
    cells = [each.baseline, str(each.runs)]
    for index in after:
        cells += [_estimate(each.best[index]), _p(each.p_best[index])]
    return [*cells, _estimate(each.objective), _p(each.p_objective)]


def _estimate(value: Estimate) -> str:
    if math.isnan(value.mean):
        return "–"
    interval = "" if math.isnan(value.low) else f" [{value.low:+.3f}, {value.high:+.3f}]"
    return f"{value.mean:+.3f}{interval}"


def _share(value: Estimate) -> str:
    return "–" if math.isnan(value.mean) else f"{value.mean:.0%}"


def _p(value: float) -> str:
    return "–" if math.isnan(value) else ("< 0.001" if value < 0.001 else f"{value:.3f}")
