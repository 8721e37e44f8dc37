"""Figures: what people would rather look at than read."""

from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
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
_MARKERS = 24  # at most, on a curve: more would hide its line
_OTHER_STYLE = ("#000000", "d", "-.")


def best_so_far(
    path: Path, summary: Summary, *, title: str, initial: int, limits: tuple[float, float]
) -> tuple[Path, Path]:
    """Draw the mean best objective so far of every method with its interval, in reproducible bytes.

    Args:
        path: of the figure; its suffix is replaced.
        summary: what is drawn; a method without a whole run is left out.
        title: above it.
        initial: shared random trials, which are shaded.
        limits: of the objective; intervals of few runs reach beyond them and are cut there.

    Returns:
        Paths of the PNG and of the SVG.
    """
    figure = Figure(figsize=(9.6, 4.4), layout="constrained")
    curves, final = figure.subplots(1, 2, sharey=True, width_ratios=(4, 1.3))
    drawn = {name: method for name, method in summary.methods.items() if method.runs}
    ranked = sorted(drawn, key=lambda name: -drawn[name].best[-1].mean)
    curves.axvspan(0.5, initial + 0.5, color="#eeeeee", linewidth=0, zorder=0)
    for place, name in enumerate(ranked):
        _draw_method(curves, final, place, name, drawn[name], limits)
    curves.set_xlim(0.5, summary.trials + 0.5)
    curves.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=12))
    curves.set_xlabel("trial (shaded: random, shared by all methods)")
    curves.set_ylabel("best objective so far, mean over runs")
    figure.suptitle(title, x=0.01, horizontalalignment="left", fontsize=10)
    final.set_xlim(-0.7, len(ranked) - 0.3)
    final.set_xticks([])
    final.set_title(f"after trial {summary.trials}", fontsize=9)
    final.spines["left"].set_visible(False)
    final.tick_params(axis="y", length=0)
    for axes in (curves, final):
        axes.grid(axis="y", color="#e5e5e5", linewidth=0.6)
    figure.legend(
        *curves.get_legend_handles_labels(),
        loc="outside right upper",
        frameon=False,
        fontsize=8,
        title="n runs; shades and\nbars: 90 % intervals",
        title_fontsize=8,
        alignment="left",
    )
    return _write(figure, path)


def _draw_method(
    curves: Axes, final: Axes, place: int, name: str, method: MethodSummary, limits: tuple[float, float]
) -> None:
    """A curve with its shaded interval, and its end once more, where intervals do not cover each other."""
    color, marker, line = STYLES.get(name, _OTHER_STYLE)
    mean, low, high = (
        np.array([getattr(estimate, part) for estimate in method.best]) for part in ("mean", "low", "high")
    )
    low, high = np.clip(low, *limits), np.clip(high, *limits)
    style: dict[str, Any] = {"color": color, "marker": marker, "markersize": 5, "markeredgewidth": 0}
    trials = np.arange(1, len(mean) + 1)
    label = f"{name} (n = {method.runs})"
    shown = {"markevery": -(-len(mean) // _MARKERS), "linestyle": line, "linewidth": 1.4, **style}
    curves.plot(trials, mean, label=label, zorder=3, **shown)
    curves.fill_between(trials, low, high, color=color, alpha=0.09, linewidth=0, zorder=1)
    final.plot([place, place], [low[-1], high[-1]], color=color, linewidth=2.5, alpha=0.5)
    final.plot([place], [mean[-1]], linestyle="", **{**style, "markersize": 7})


def _write(figure: Figure, path: Path) -> tuple[Path, Path]:
    png, svg = path.with_suffix(".png"), path.with_suffix(".svg")
    with replacing(png) as unfinished:
        figure.savefig(unfinished, dpi=150)
    with replacing(svg) as unfinished:
        figure.savefig(unfinished, metadata={"Date": None})
    return png, svg
