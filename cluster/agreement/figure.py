"""The picture of an agreement: every controller in both simulations."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from jaxtyping import Float
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from cluster.files import replacing

_GREY, _ORANGE = "#4d4d4d", "#d55e00"
Sides = Float[np.ndarray, "2 controllers"]


def scatter(path: Path, names: tuple[str, str], f: Sides, y: Sides, document: Mapping[str, Any]) -> None:
    """Draw objective and badness of every controller in one simulation against the other.

    Args:
        path: of the picture, .png.
        names: of the one, along x, and the other, along y.
        f: objectives in both, [2, controllers].
        y: badness in both, [2, controllers].
        document: of the agreement; its Spearman correlations and its best are shown.
    """
    spearman = {
        each["name"]: "none" if each["spearman"] is None else f"{each['spearman']:.2f}"
        for each in document["measures"]
    }
    count = document["best"]["count"]
    best = np.argsort(-f[0], kind="stable")[:count]
    with mpl.rc_context({"axes.spines.top": False, "axes.spines.right": False, "font.size": 9}):
        figure = Figure(figsize=(8.4, 4.4), layout="constrained")
        left, right = figure.subplots(1, 2)
        _panel(left, f, best, f"objective f, Spearman {spearman['objective']}", names)
        _panel(right, y, best, f"badness y, Spearman {spearman['badness']}", names)
        figure.legend(
            handles=left.collections,
            labels=[f"{f.shape[1] - count} other controllers", f"the best {count} of {names[0]}"],
            loc="outside lower center",
            ncols=2,
            frameon=False,
        )
        with replacing(path) as unfinished:
            figure.savefig(unfinished, format="png", dpi=120, metadata={"Software": None})


def _panel(axes: Axes, sides: Sides, best: np.ndarray, title: str, names: tuple[str, str]) -> None:
    others = np.setdiff1d(np.arange(sides.shape[1]), best)
    axes.scatter(sides[0, others], sides[1, others], s=12, color=_GREY, alpha=0.45, linewidths=0)
    axes.scatter(sides[0, best], sides[1, best], s=26, color=_ORANGE, marker="D", linewidths=0)
    low, high = float(sides.min()), float(sides.max())
    axes.plot([low, high], [low, high], color="#bbbbbb", linewidth=0.8, zorder=0)
    axes.set_title(title, fontsize=10)
    axes.set_xlabel(f"in {names[0]}")
    axes.set_ylabel(f"in {names[1]}")
