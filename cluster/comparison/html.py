"""A comparison as one HTML file that opens anywhere: verdict, figures, tables, settings, fingerprints."""

import math
from base64 import b64encode
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from svaedc.analysis.statistics import Estimate
from svaedc.analysis.summary import Difference, MethodSummary, Summary
from svaedc.analysis.verdict import judge, leader, sentences, verdict
from svaedc.analysis.words import quantity

TEMPLATE = "report.html.j2"
"""The page: its words, its tables and their columns. What is computed for it is below."""
_MEDIA_TYPES = {".svg": "image/svg+xml", ".png": "image/png"}
_TUNING = "These runs have tuning seeds: they are for choosing settings, and their numbers are no results."


def page(
    title: str,
    summary: Summary,
    figures: Sequence[Path],
    initial: int,
    settings: Mapping[str, Any],
    missing: str = "",
) -> str:
    """Compose the whole page; it loads nothing from elsewhere and runs no script.

    Args:
        title: what was compared.
        summary: the numbers, all of them computed before.
        figures: files to embed.
        initial: shared random trials.
        settings: what the comparison was made with, fingerprints included.
        missing: a sentence on what it lacks of what was asked for; "" for nothing.

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
        "number": _number,
        "interval": _interval,
        "share": _share,
        "until_success": _until_success,
        "p_value": _p_value,
        "judgement": partial(judge, summary),
        "quantity": quantity,
    }
    first, methods = leader(summary), summary.methods
    return environment.get_template(TEMPLATE).render(
        title=title,
        notes=list(_notes(summary, missing)),
        verdict=verdict(summary),
        sentences=list(sentences(summary, first)) if first else [],
        leader=first,
        trials=summary.trials,
        level=f"{summary.confidence * 100:g} %",
        initial=initial,
        figures=[_image(path) for path in figures],
        checkpoints=[(index, _after(index, initial)) for index in checkpoints(summary, initial)],
        methods=sorted(methods.items(), key=_best_first),
        breakable=any(not math.isnan(method.broken_trials.mean) for method in methods.values()),
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


def _after(index: int, initial: int) -> str:
    """The head of the column of a trial."""
    suggested = index + 1 - initial
    return f"best after {suggested} suggested" if suggested > 0 else f"best after {index + 1} random"


def _notes(summary: Summary, missing: str) -> Iterable[str]:
    """What a reader would otherwise wonder about."""
    if missing:
        yield f"{missing}."
    if summary.purpose != "reporting":
        yield _TUNING
    ran = [method for method in summary.methods.values() if method.runs]
    if ran and not any(method.first_success.reached for method in ran):
        yield "Nobody reached the threshold of success: no run of any method succeeded in any trial."
    failed, tried = (
        sum(getattr(method, name) for method in summary.methods.values()) for name in ("failed", "tried")
    )
    if failed:
        yield (
            f"{failed} of {quantity(tried, 'trial')} failed: they gave no objective. They teach no method "
            "anything, are not tried again, and enter no mean."
        )


def _image(path: Path) -> dict[str, str]:
    data = b64encode(path.read_bytes()).decode()
    return {"name": path.stem, "type": _MEDIA_TYPES[path.suffix], "data": data}


def _best_first(named: tuple[str, MethodSummary]) -> tuple[bool, float]:
    """Methods without an objective come last, and those without a whole run after them."""
    _, method = named
    best = method.best[-1].mean
    return (not method.runs, math.inf if math.isnan(best) else -best)


def _until_success(method: MethodSummary) -> str:
    median = method.first_success.median
    return "not reached" if math.isnan(median) else f"{median:g}"


def _differences_by_method(summary: Summary) -> Iterator[tuple[str, list[Difference]]]:
    """The differences of each method that was compared with another, those of the leader first."""
    for name in sorted(summary.methods, key=lambda name: name != leader(summary)):
        found = [each for each in summary.differences if each.method == name]
        if found:
            yield name, found


def _number(value: Estimate) -> str:
    return "–" if math.isnan(value.mean) else f"{value.mean:+.3f}"


def _interval(value: Estimate) -> str:
    """Nothing where too few runs tell."""
    return "" if math.isnan(value.low) else f"[{value.low:+.3f}, {value.high:+.3f}]"


def _share(value: Estimate) -> str:
    return "–" if math.isnan(value.mean) else f"{value.mean:.0%}"


def _p_value(value: float) -> str:
    return "" if math.isnan(value) else ("p < 0.001" if value < 0.001 else f"p = {value:.3f}")
