"""A campaign as one HTML file: every trial, decision and note, and predictions beside measurements."""

import io
import json
from base64 import b64encode
from collections.abc import Mapping, Sequence
from itertools import accumulate
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cluster.hardware.events import Event, moment_in_words
from cluster.hardware.record.attachments import Attachment
from cluster.hardware.states import State
from workers.hardware import robots

TEMPLATE = "page.html.j2"
_TOLD = (
    "f", "y", "predicted_y", "reason", "note", "fault", "cause", "until", "limits", "campaign", "seconds",
    "stop",
)  # fmt: skip
_ABOVE: dict[str, Any] = {"frameon": False, "ncols": 3, "loc": "lower left", "bbox_to_anchor": (0, 1)}
_MEASURED, _BEST = "#0072b2", "#d55e00"


def page(
    name: str,
    identity: Mapping[str, Any],
    rows: Sequence[Mapping[str, Any]],
    events: Sequence[Event],
    attached: Sequence[Attachment],
) -> str:
    """Compose the page; it loads nothing from elsewhere and runs no script.

    Args:
        name: of the campaign.
        identity: its facts.
        rows: of its trials.
        events: of its journal.
        attached: files of its trials; the page links to them, in the folder of the campaign.

    Returns:
        The page as HTML.
    """
    environment = Environment(
        loader=PackageLoader("cluster.hardware.record", "."),
        autoescape=True,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters |= {"number": number, "when": when}
    files: dict[int, list[Attachment]] = {}
    for each in attached:
        files.setdefault(each.trial, []).append(each)
    measured = [row for row in rows if row["state"] == State.MEASURED]
    return environment.get_template(TEMPLATE).render(
        name=name,
        stand_in=_is_stand_in(str(identity["robot"])),
        identity=list(identity.items()),
        rows=rows,
        files=files,
        measured=len(measured),
        best=max(measured, key=lambda row: row["f"], default=None),
        figure=b64encode(progress(measured)).decode() if measured else "",
        events=[(event, facts_told(event)) for event in events],
    )


def _is_stand_in(robot: str) -> bool:
    try:
        return robots.find(robot).simulated
    except LookupError:  # its module is not here
        return False


def facts_told(event: Event) -> list[tuple[str, str]]:
    """What a person wants to read of an event's body, by name."""
    body = json.loads(event.body)
    return [(name, number(body[name])) for name in _TOLD if body.get(name) not in (None, "")]


def progress(measured: Sequence[Mapping[str, Any]]) -> bytes:
    """Draw the objectives of measured trials, and their badness beside what was expected of it, as SVG."""
    figure = Figure(figsize=(9, 3), layout="constrained")
    left, right = figure.subplots(1, 2)
    _draw_objectives(left, measured)
    _draw_badness(right, measured)
    content = io.BytesIO()
    figure.savefig(content, format="svg", metadata={"Date": None})
    return content.getvalue()


def _draw_objectives(axes: Axes, measured: Sequence[Mapping[str, Any]]) -> None:
    numbers = [row["trial"] for row in measured]
    f = [row["f"] for row in measured]
    axes.step(numbers, list(accumulate(f, max)), where="post", color=_BEST, label="best so far")
    axes.plot(numbers, f, "o", color=_MEASURED, label="measured")
    simulated = [(row["trial"], row["simulated_f"]) for row in measured if row["simulated_f"] is not None]
    if simulated:
        axes.plot(*zip(*simulated, strict=True), "x", color="#666", label="mean of simulations")
    axes.set(xlabel="trial", ylabel="objective f")
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.legend(**_ABOVE)


def _draw_badness(axes: Axes, measured: Sequence[Mapping[str, Any]]) -> None:
    axes.axline((0, 0), slope=1, color="#bbb", linewidth=1)
    for column, marker, label in (("predicted_y", "o", "model"), ("simulated_y", "x", "mean of simulations")):
        known = [(row[column], row["y"]) for row in measured if row[column] is not None]
        if known:
            axes.plot(*zip(*known, strict=True), marker, color=_MEASURED, label=label)
    axes.set(xlabel="badness y, predicted", ylabel="measured", xlim=(-0.03, 1.03), ylim=(-0.03, 1.03))
    if axes.get_legend_handles_labels()[0]:
        axes.legend(**_ABOVE)
    else:
        axes.text(0.5, 0.5, "nothing was predicted", ha="center", color="#666")


def number(value: Any) -> str:
    """A value for people; "" for none."""
    if value is None:
        return ""
    return f"{value:.3f}" if isinstance(value, float) else str(value)


def when(at: str | None) -> str:
    """A moment for people; "" for none."""
    return "" if at is None else moment_in_words(at)
