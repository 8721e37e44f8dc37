"""The figure of a comparison: how the best objective grows, trial by trial, and where every method ends."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from cluster.files import replacing
from svaedc.analysis.summary import MethodSummary, Summary

mpl.rcParams.update(
    {"axes.spines.top": False, "axes.spines.right": False, "font.size": 9, "svg.hashsalt": "svaedc"}
)

STYLES = {
    "random": ("#8c8c8c", "o", ":"),
    "screened-random": ("#4d4d4d", "s", ":"),
    "botorch": ("#e69f00", "X", "--"),
    "matern": ("#56b4e9", "v", "--"),
    "se": ("#0072b2", "D", "--"),
    "svae": ("#cc79a7", "^", "-"),
    "screened-svae": ("#aa4499", "<", "-"),
    "svae-dc": ("#d55e00", "*", "-"),
    "svae-dc-whitened": ("#009e73", "P", "-"),
    "svae-dc-online": ("#117733", "8", "-"),
    "svae-dc-sigmoid": ("#a6761d", "p", "-"),
    "svae-matern": ("#cc79a7", ">", "-."),
    "svae-dc-matern": ("#d55e00", "h", "-."),
    "bbk-kl": ("#666633", (4, 1, 0), "-"),
    "lkl": ("#b2a300", (4, 1, 45), "-"),
    "se-acqf": ("#0072b2", "d", ":"),
    "matern-acqf": ("#56b4e9", "H", ":"),
    "turbo": ("#661100", (6, 1, 0), "--"),
    "saasbo": ("#332288", (3, 1, 0), "--"),
}
"""Each method has a colour (Okabe and Ito's, which colour-blind people can tell apart), a marker and a line.
A line is dotted without a model of f or by `optimize_acqf`, dashed on controllers, solid on latent paths; a
variant shares its colour. Markers are drawn without edges, so all are filled ones; a tuple is a star of that
many points, turned by degrees."""
_OTHER_STYLE = ("#000000", "d", "-.")
_MARKERS = 6
"""A curve has about so many: more would hide its line."""
_FEW = 5
"""Up to so many runs are drawn one by one: their intervals, shaded, would cover each other and tell less."""

Curves = Mapping[str, Float[np.ndarray, "runs trials"]]
"""They are the best objectives so far of every whole run, by method."""


@dataclass(frozen=True, eq=False)
class _Line:
    """A method as it is drawn."""

    name: str
    place: int
    method: MethodSummary
    runs: Float[np.ndarray, "runs trials"]
    limits: tuple[float, float]

    @property
    def mean(self) -> Float[np.ndarray, " trials"]:
        return np.array([estimate.mean for estimate in self.method.best])

    @property
    def interval(self) -> Float[np.ndarray, "2 trials"]:
        """Its low and high ends, cut at what an objective can be; NaN of one run."""
        low, high = np.array([(estimate.low, estimate.high) for estimate in self.method.best]).T
        least, most = self.limits
        return np.stack(
            [np.maximum(low, np.fmin(least, self.mean)), np.minimum(high, np.fmax(most, self.mean))]
        )

    @property
    def is_of_few(self) -> bool:
        return len(self.runs) <= _FEW


def best_so_far(
    path: Path, summary: Summary, curves: Curves, *, title: str, initial: int, limits: tuple[float, float]
) -> tuple[Path, Path]:
    """Draw the mean best objective so far of every method with its runs or interval, in reproducible bytes.

    Args:
        path: of the figure; its suffix is replaced.
        summary: what is drawn; a method without a whole run, or without an objective, is only named.
        curves: of the same runs.
        title: above it.
        initial: shared random trials, which are shaded.
        limits: of the objective; intervals of few runs reach beyond them and are cut there.

    Returns:
        Paths of the PNG and of the SVG.
    """
    figure = Figure(figsize=(9.6, 4.4), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True, width_ratios=(4, 1.3))
    lines = [
        _Line(name, place, summary.methods[name], curves[name], limits)
        for place, name in enumerate(_best_first(summary))
    ]
    left.axvspan(0.5, initial + 0.5, color="#eeeeee", linewidth=0, zorder=0)
    for line in lines:
        _draw_curve(left, line)
        _draw_end(right, line)
    for name in sorted(summary.methods.keys() - {line.name for line in lines}):
        absence = "no objective" if summary.methods[name].runs else "no whole run"
        left.plot([], [], linestyle="", label=f"{name}: {absence}")
    _show_runs_whole(left, lines)
    _label(left, right, summary.trials, lines)
    figure.suptitle(title, x=0.01, horizontalalignment="left", fontsize=10)
    _add_legend(figure, left, lines, f"{summary.confidence * 100:g} %")
    return _write(figure, path)


def _best_first(summary: Summary) -> list[str]:
    """The methods that have a curve."""
    ends = {name: method.best[-1].mean for name, method in summary.methods.items() if method.runs}
    return sorted((name for name, end in ends.items() if not math.isnan(end)), key=lambda name: -ends[name])


def _draw_curve(axes: Axes, line: _Line) -> None:
    """A curve with its runs, where they are few, or its shaded interval."""
    color, marker, dashes = STYLES.get(line.name, _OTHER_STYLE)
    trials = np.arange(1, len(line.mean) + 1)
    step = -(-len(trials) // _MARKERS)
    axes.plot(
        trials,
        line.mean,
        label=line.name,
        color=color,
        linestyle=dashes,
        linewidth=0.9 if len(line.runs) == 1 else 1.5,
        marker=marker,
        markersize=5,
        markeredgewidth=0,
        markevery=(line.place % step, step),  # so that curves that meet show all their markers
        zorder=3,
    )
    if not line.is_of_few:
        axes.fill_between(trials, *line.interval, color=color, alpha=0.09, linewidth=0, zorder=1)
    elif len(line.runs) > 1:
        axes.plot(trials, line.runs.T, color=color, linewidth=0.6, alpha=0.55, zorder=2)


def _draw_end(axes: Axes, line: _Line) -> None:
    """Where a curve ends, beside the others, so that intervals do not cover each other."""
    color, marker, _ = STYLES.get(line.name, _OTHER_STYLE)
    place: list[float] = [line.place]
    dots: dict[str, Any] = {"linestyle": "", "color": color, "markeredgewidth": 0}
    axes.plot(place * 2, line.interval[:, -1], color=color, linewidth=2.5, alpha=0.5)
    if line.is_of_few and len(line.runs) > 1:
        axes.plot(place * len(line.runs), line.runs[:, -1], marker=".", markersize=4, alpha=0.55, **dots)
    axes.plot(place, line.mean[-1:], marker=marker, markersize=7, **dots)


def _show_runs_whole(axes: Axes, lines: Sequence[_Line]) -> None:
    """Fits the axis to the runs where all are few: Student's intervals of two runs are six times as wide."""
    if not lines or not all(line.is_of_few for line in lines):
        return
    low = min(np.nanmin(line.runs) for line in lines)
    high = max(np.nanmax(line.runs) for line in lines)
    margin = 0.08 * (high - low) or 1.0
    axes.set_ylim(low - margin, high + margin)


def _label(left: Axes, right: Axes, trials: int, lines: Sequence[_Line]) -> None:
    left.set_xlim(0.5, trials + 0.5)
    left.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=12))
    left.set_xlabel("trial (shaded: random, shared by all methods)")
    mean = ", mean over runs" if any(len(line.runs) > 1 for line in lines) else ""
    left.set_ylabel(f"best objective f so far{mean}")
    right.set_xlim(-0.7, max(1, len(lines)) - 0.3)
    right.set_xticks([])
    right.set_title(f"after trial {trials}", fontsize=9)
    right.spines["left"].set_visible(False)
    right.tick_params(axis="y", length=0)
    for axes in (left, right):
        axes.grid(axis="y", color="#e5e5e5", linewidth=0.6)


def _add_legend(figure: Figure, axes: Axes, lines: Sequence[_Line], level: str) -> None:
    """Names the methods; how many runs they have is said once where all have as many."""
    counts = {line.name: len(line.runs) for line in lines}
    alike = len(set(counts.values())) <= 1
    handles, names = axes.get_legend_handles_labels()
    labels = [name if alike or name not in counts else f"{name} (n = {counts[name]})" for name in names]
    figure.legend(
        handles,
        labels,
        loc="outside right upper",
        frameon=False,
        fontsize=8,
        title="\n".join(_explanations(lines, axes.get_ylim(), level)),
        title_fontsize=8,
        alignment="left",
    )


def _explanations(lines: Sequence[_Line], frame: tuple[float, float], level: str) -> list[str]:
    """What the legend says above the names."""
    numbers = {len(line.runs) for line in lines}
    if not lines:
        return ["nothing to draw yet"]
    if numbers == {1}:
        return ["n = 1 run each:", "no interval"]
    runs = f"n = {min(numbers)} runs each" if len(numbers) == 1 else "n runs"
    singles = ["thin lines, dots: single runs"] if any(line.is_of_few for line in lines) else []
    shades = "bars" if all(line.is_of_few for line in lines) else "shades and bars"
    ends = [line.interval[:, -1] for line in lines]
    is_cut = any(low < frame[0] or frame[1] < high for low, high in ends)
    bars = (
        [f"{shades}: {level} intervals,", "cut at the frame"] if is_cut else [f"{shades}: {level} intervals"]
    )
    return [runs, *singles, *bars]


def _write(figure: Figure, path: Path) -> tuple[Path, Path]:
    png, svg = path.with_suffix(".png"), path.with_suffix(".svg")
    with replacing(png) as unfinished:
        figure.savefig(unfinished, dpi=150)
    with replacing(svg) as unfinished:
        figure.savefig(unfinished, metadata={"Date": None})
    return png, svg
