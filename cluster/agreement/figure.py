"""The picture of an agreement: every controller in both simulations."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from cluster.files import replacing
from svaedc.analysis.agreement import Agreement, Simulated, best_places

_GREY, _ORANGE = "#4d4d4d", "#d55e00"


def scatter(path: Path, one: Simulated, other: Simulated, found: Agreement) -> None:
    """Draw objective and badness of every controller in one simulation against the other.

    Args:
        path: of the picture, .png.
        one: what it gave, along x.
        other: what it gave, along y.
        found: how far they agree.
    """
    best = best_places(one.f)
    others = np.setdiff1d(np.arange(len(one.f)), best)
    with mpl.rc_context({"axes.spines.top": False, "axes.spines.right": False, "font.size": 9}):
        figure = Figure(figsize=(8.4, 4.4), layout="constrained")
        columns = (one.f, other.f), (one.y, other.y)
        for axes, measure, (x, y) in zip(figure.subplots(1, 2), found.measures[:2], columns, strict=True):
            axes.scatter(x[others], y[others], s=12, color=_GREY, alpha=0.45, linewidths=0)
            axes.scatter(x[best], y[best], s=26, color=_ORANGE, marker="D", linewidths=0)
            ends = [float(min(x.min(), y.min())), float(max(x.max(), y.max()))]
            axes.plot(ends, ends, color="#bbbbbb", linewidth=0.8, zorder=0)
            axes.set_title(f"{measure.name}, Spearman {measure.spearman:.2f}", fontsize=10)
            axes.set_xlabel(f"in {one.name}")
            axes.set_ylabel(f"in {other.name}")
        figure.legend(
            handles=axes.collections,
            labels=[f"{len(others)} other controllers", f"the best {len(best)} of {one.name}"],
            loc="outside lower center",
            ncols=2,
            frameon=False,
        )
        with replacing(path) as unfinished:
            figure.savefig(unfinished, format="png", dpi=120, metadata={"Software": None})
