"""Figures: what people would rather look at than read."""

from collections.abc import Mapping
from pathlib import Path

import matplotlib as mpl
import numpy as np
import torch
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from svaedc.episodes import Episodes
from svaedc.model import SvaeDc
from svaedc.statistics import Summary
from workers.dataset.identity import Identity

mpl.rcParams.update(
    {"axes.spines.top": False, "axes.spines.right": False, "font.size": 9, "svg.hashsalt": "svaedc"}
)

_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#666666", "#000000", "#f0e442")
_MARKERS = "osD^vP*Xd"


def best_so_far(
    path: Path, summary: Summary, *, title: str, initial: int, limits: tuple[float, float]
) -> tuple[Path, Path]:
    """Mean best objective so far of every method with its interval, as PNG and SVG.

    Args:
        path: of the figure; its suffix is replaced.
        summary: what is drawn.
        title: above it.
        initial: shared random trials, which are shaded.
        limits: of the objective; intervals of few runs reach beyond them and are cut there.
    """
    figure = Figure(figsize=(7.4, 4.2), layout="constrained")
    axes = figure.subplots()
    trials = np.arange(1, summary.trials + 1)
    axes.axvspan(0.5, initial + 0.5, color="#eeeeee", zorder=0)
    for (name, method), colour, marker in zip(summary.methods.items(), _COLOURS, _MARKERS, strict=False):
        mean, low, high = (
            np.array([getattr(estimate, part) for estimate in method.best])
            for part in ("mean", "low", "high")
        )
        axes.plot(
            trials, mean, color=colour, marker=marker, markersize=3.5, label=f"{name} (n = {method.runs})"
        )
        axes.fill_between(trials, low, high, color=colour, alpha=0.15, linewidth=0)
    axes.set(
        xlabel="trial (the first, shaded, are random and shared)", ylabel="best objective so far", title=title
    )
    axes.set_xlim(0.5, summary.trials + 0.5)
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, limits[0]), min(top, limits[1]))
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    return _write(figure, path)


def reconstruction(path: Path, model: SvaeDc, held_out: Episodes, identity: Identity) -> Path:
    """Original, reconstructed and generated channels of four held-out episodes, least bad to worst."""
    order = np.argsort(held_out.y[held_out.rows])
    chosen = order[np.linspace(0, len(order) - 1, 4).astype(int)]
    batch = [held_out.gather(np.array([position]), torch.device("cpu")) for position in chosen]
    channels = _moving_channels(held_out, identity)
    figure = Figure(figsize=(11, 7.5), layout="constrained")
    rows = figure.subplots(len(channels), len(batch), sharex=True, squeeze=False)
    with torch.no_grad():
        for column, one in enumerate(batch):
            curves = {
                "original": one.xi,
                "reconstructed": model.reconstruct(one.xi, one.bad, one.y),
                "generated from x": model.generate(one.x),
            }
            rows[0][column].set_title(f"bad in {float(one.y[0]):.0%} of the steps")
            for row, channel in enumerate(channels):
                _draw(
                    rows[row][column], {name: xi[0, channel].numpy() for name, xi in curves.items()}, identity
                )
    for row, channel in enumerate(channels):
        name, unit, _, _ = identity.observation[channel]
        rows[row][0].set_ylabel(f"{name} ({unit})")
    rows[0][0].legend(frameon=False, fontsize=8)
    figure.supxlabel("time (s)")
    figure.savefig(path, dpi=130)
    return path


def _moving_channels(held_out: Episodes, identity: Identity) -> list[int]:
    """The channels that move most: one angle, two positions, one part of an orientation, as there are any."""
    spread = held_out.xi[held_out.rows[:256]].std(axis=(0, 2))
    units = np.array([unit for _, unit, _, _ in identity.observation])
    chosen: list[int] = []
    for unit, count in (("rad", 1), ("m", 2), ("1", 1)):
        candidates = np.flatnonzero(units == unit)
        chosen += candidates[np.argsort(-spread[candidates], kind="stable")][:count].tolist()
    return chosen


def _draw(axes: Axes, curves: Mapping[str, np.ndarray], identity: Identity) -> None:
    for (name, values), colour in zip(curves.items(), ("#000000", "#0072b2", "#d55e00"), strict=True):
        seconds = np.linspace(0, identity.horizon * identity.control_step, len(values))
        axes.plot(seconds, values, label=name, color=colour, linewidth=1.2)


def _write(figure: Figure, path: Path) -> tuple[Path, Path]:
    png, svg = path.with_suffix(".png"), path.with_suffix(".svg")
    figure.savefig(png, dpi=150)
    figure.savefig(svg, metadata={"Date": None})
    return png, svg
