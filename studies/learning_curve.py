"""The learning curve: the same model on 2,000, 4,000, 8,000 … episodes, measured on the same held-out ones.

Subsets are nested. Every model gets the same number of updates. `python -m studies.learning_curve --dataset
data/franka` leaves a table and a figure, and says what more episodes would buy if the curve went on.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from studies.cells import Result, Study, arguments, results, table, written
from studies.training import Source, begun, halves, measures, preset_for, train, worths

SMALLEST = 2_000
SECONDS_PER_UPDATE = 0.04  # of the compact preset, on one thread
FAR = 500_000
COLUMNS = {
    "rec_norm": "reconstructed",
    "gen_norm": "generated",
    "corr_y_rec": "y rec",
    "corr_y_gen": "y gen",
    "active_dimensions": "active",
    "svae-dc best": "svae-dc: best after 10",
    "screened-random best": "screened-random",
    "seconds": "CPU s",
}


@dataclass(frozen=True)
class Cell:
    """One model."""

    fingerprint: str
    count: int
    updates: int
    seed: int


def compute(source: Source, cell: Cell) -> Result:
    """Train and measure one model."""
    dataset, cache = source.opened()
    training, held_out = halves(cache, cell.count)
    made = preset_for(cache, "compact", {}, cell.seed)
    model = begun(made, training, dataset)
    seconds = train(model, training, held_out, made.training.with_updates(cell.updates, 0))
    return {**measures(model, held_out), **worths(model, dataset, cache, held_out), "seconds": seconds}


def counts(available: int) -> list[int]:
    """Doublings from 2,000 on, and all there are."""
    doublings = [SMALLEST * 2**power for power in range(20)]
    return [*(count for count in doublings if count < 0.9 * available), available]


def extrapolated(counts: Sequence[int], errors: Sequence[float], count: int) -> tuple[float, float]:
    """Change per doubling, and the error at a count, of a line through the last three points over log2."""
    slope, offset = np.polyfit(np.log2(counts[-3:]), errors[-3:], 1)
    return float(slope), float(slope * math.log2(count) + offset)


def draw(path: Path, cells: Sequence[Cell], found: Sequence[Result]) -> None:
    """Errors, correlations of y and the worth for Bayesian optimisation over episodes."""
    figure = Figure(figsize=(11, 3.6), layout="constrained")
    panels = {
        "error relative to the per-step median": ("gen_norm", "rec_norm"),
        "correlation of y": ("corr_y_gen", "corr_y_rec"),
        "best of 2 + 10 trials among held-out": ("svae-dc best", "screened-random best"),
    }
    for axes, (title, names) in zip(figure.subplots(1, 3), panels.items(), strict=True):
        for name, color in zip(names, ("#d55e00", "#0072b2"), strict=True):
            values = [result[name] for result in found]
            axes.plot([cell.count for cell in cells], values, "o-", color=color, label=COLUMNS[name])
        axes.set_xscale("log", base=2)
        labels = [f"{cell.count / 1e3:.3g}k" for cell in cells]
        axes.set_xticks([cell.count for cell in cells], labels, rotation=45)
        axes.minorticks_off()
        axes.set_xlabel("training episodes")
        axes.set_title(title, fontsize=10)
        axes.legend(frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)


def main() -> None:
    """Compute the cells that are missing, then write the table and the figure."""
    parser = arguments(__doc__, "learning-curve")
    parser.add_argument("--updates", type=int, default=4_000)
    parser.add_argument("--seed", type=int, default=0)
    given = parser.parse_args()
    source = Source(given.dataset, given.cache)
    dataset, cache = source.opened()
    sizes = counts(len(cache.training()))
    if len(sizes) < 2:
        parser.error(f"a curve needs over {SMALLEST:,} training episodes, {source.dataset} has {sizes[0]:,}")
    cells = [Cell(dataset.fingerprint(), count, given.updates, given.seed) for count in sizes]
    cost = SECONDS_PER_UPDATE * given.updates + 20
    found = results(Study(given.out), cells, partial(compute, source), cost, given.processes)
    rows = [
        [f"{cell.count:,}", *(f"{result[name]:.3g}" for name in COLUMNS)]
        for cell, result in zip(cells, found, strict=True)
    ]
    slope, far = extrapolated(sizes, [result["gen_norm"] for result in found], FAR)
    note = (
        f"\n{dataset.identity.setup}, fingerprint {dataset.fingerprint()[:12]}, {given.updates} updates, "
        f"seed {given.seed}, {len(cache.held_out())} held-out episodes. Over the last doublings the "
        f"generated error changes by {slope:+.3f} each; if it went on like this, {FAR:,} episodes would "
        f"leave {far:.2f}.\n"
    )
    draw(given.out / "figure.png", cells, found)
    written(given.out / "table.md", table(["episodes", *COLUMNS.values()], rows) + note)


if __name__ == "__main__":
    main()
