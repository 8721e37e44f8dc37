"""A comparison as one HTML file that opens anywhere: figures, tables, settings, fingerprints."""

import math
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from svaedc.analysis.statistics import Estimate
from svaedc.analysis.summary import Difference, MethodSummary, Summary

TEMPLATE = "report.html.j2"
"""The page: its words, its tables and their columns. What is computed for it is below."""
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
    environment = Environment(
        loader=PackageLoader("cluster.comparison", "."),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "estimate": _estimate,
        "share": _share,
        "until_success": _until_success,
        "p_value": _p_value,
    }
    return environment.get_template(TEMPLATE).render(
        title=title,
        notes=[*([_TUNING] if summary.purpose != "reporting" else []), *_remarks(summary)],
        trials=summary.trials,
        initial=initial,
        figures=[_image(path) for path in figures],
        after=checkpoints(summary, initial),
        methods=sorted(summary.methods.items(), key=_best_first),
        differences=list(_differences_by_method(summary)),
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


def _best_first(named: tuple[str, MethodSummary]) -> float:
    best = named[1].best[-1].mean
    return math.inf if math.isnan(best) else -best


def _until_success(method: MethodSummary) -> str:
    found = method.first_success
    median = "not reached" if math.isnan(found.median) else f"{found.median:g}"
    return f"{median} ({found.reached} of {method.runs} runs)"


def _differences_by_method(summary: Summary) -> Iterator[tuple[str, list[Difference]]]:
    """The differences of each method that was compared with another."""
    for name in summary.methods:
        found = [each for each in summary.differences if each.method == name]
        if found:
            yield name, found


def _estimate(value: Estimate) -> str:
    if math.isnan(value.mean):
        return "–"
    interval = "" if math.isnan(value.low) else f" [{value.low:+.3f}, {value.high:+.3f}]"
    return f"{value.mean:+.3f}{interval}"


def _share(value: Estimate) -> str:
    return "–" if math.isnan(value.mean) else f"{value.mean:.0%}"


def _p_value(value: float) -> str:
    return "–" if math.isnan(value) else ("< 0.001" if value < 0.001 else f"{value:.3f}")
