"""What SVAE-DC's gain depends on: number of episodes, KL weight, sim-to-real gap, pool, and a rough G_bad.

One change at a time from what `svaedc train` and `compare` do by themselves. Each cell has a model of its
own, unless another cell has the same, and simulated runs of `svae-dc` and `random` on tuning seeds.
`python -m studies.sensitivity --dataset data/franka`
"""

import hashlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.figure import Figure

from cluster.comparison.folder import ComparisonFolder
from cluster.comparison.records import RunKey, rows
from cluster.comparison.worker import ComparisonJob
from studies.cells import Result, Study, arguments, results, table, written
from studies.training import Source, begun, halves, measures, preset_for, train
from svaedc.analysis.aggregation import summarize
from svaedc.analysis.seeds import FIRST_TUNING
from svaedc.analysis.summary import Reporting
from svaedc.data.episodes import Episodes
from svaedc.model import checkpoint
from workers import setups

INITIAL, TRIALS = 2, 20
AFTER = (10, 20)
SECONDS_PER_UPDATE, SECONDS_PER_TRIAL = 0.037, 0.08
SAME = "as it is"
PARTS = ("mean", "low", "high")


@dataclass(frozen=True)
class Cell:
    """One model, and runs with it.

    Attributes:
        fingerprint: of the dataset.
        count: of training episodes.
        kl: weight of the KL term.
        bad: what is done to G_bad, a name of `ROUGH`.
        updates: of training.
        gap: level of the hidden physics.
        pool: candidates of each run.
        runs: of each method.
    """

    fingerprint: str
    count: int
    kl: float
    bad: str
    updates: int
    gap: str
    pool: int
    runs: int

    @property
    def model(self) -> str:
        """The same for cells that share a model."""
        return _digest((self.fingerprint, self.count, self.kl, self.bad, self.updates))


def flipped(share: float, episodes: Episodes) -> Episodes:
    """G_bad says the opposite in this share of all steps."""
    wrong = np.random.default_rng(0).random(episodes.bad.shape) < share
    return _with_bad(episodes, np.where(wrong, 1 - episodes.bad, episodes.bad))


def late(share: float, episodes: Episodes) -> Episodes:
    """G_bad notices everything this share of an episode too late."""
    lag = max(1, round(share * episodes.bad.shape[1]))
    return _with_bad(episodes, np.pad(episodes.bad[:, :-lag], ((0, 0), (lag, 0))))


def _with_bad(episodes: Episodes, bad: np.ndarray) -> Episodes:
    bad = bad.astype(np.float32)
    return replace(episodes, bad=bad, y=bad.mean(axis=1))


ROUGH: Final[Mapping[str, Callable[[Episodes], Episodes]]] = {
    SAME: lambda episodes: episodes,
    "10 % of steps flipped": partial(flipped, 0.1),
    "30 % of steps flipped": partial(flipped, 0.3),
    "10 % of the episode late": partial(late, 0.1),
    "30 % of the episode late": partial(late, 0.3),
}
CHANGES: Final[Mapping[str, Mapping[str, Any]]] = {
    "none": {},
    **{f"KL weight {kl:g}": {"kl": kl} for kl in (0.1, 0.3, 3.0, 10.0)},
    **{f"gap {gap}": {"gap": gap} for gap in ("training", "wide")},
    **{f"pool of {pool}": {"pool": pool} for pool in (500, 20_000)},
    **{f"G_bad: {bad}": {"bad": bad} for bad in ROUGH if bad != SAME},
}


def compute(source: Source, out: Path, cell: Cell) -> Result:
    """Train the model, run both methods, and say what the pairs differ by."""
    dataset, cache = source.opened()
    training, held_out = (ROUGH[cell.bad](half) for half in halves(cache, cell.count))
    path = out / "models" / f"{cell.model}.pt"
    if not path.exists():
        made = preset_for(cache, "compact", {"kl_weight": cell.kl}, 0)
        model = begun(made, training, dataset)
        train(model, training, held_out, made.training.with_updates(cell.updates, 0))
        path.parent.mkdir(parents=True, exist_ok=True)
        checkpoint.save(path, model, {"setup": dataset.identity.setup})
    model, _ = checkpoint.load(path)
    found = measures(model, held_out)
    return {
        **gains(cell, dataset.identity.setup, path, out),
        "gen": found["gen_norm"],
        "y": found["corr_y_gen"],
    }


def gains(cell: Cell, setup_name: str, model: Path, out: Path) -> dict[str, float]:
    """Mean and interval of the paired difference after some trials; every trial is on disk at once."""
    setup, random = setups.load(setup_name), replace(cell, count=0, kl=0.0, bad=SAME, pool=0, updates=0)
    kept = {}
    with setup.open() as environment:
        # What `random` does depends on no model and no pool: its runs are shared.
        for method, of in (("random", random), ("svae-dc", cell)):
            folder = ComparisonFolder(out / "runs" / _digest(tuple(asdict(replace(of, runs=0)).values())))
            (folder.path / "runs").mkdir(parents=True, exist_ok=True)
            job = ComparisonJob(folder, setup.name, cell.gap, (str(model),), cell.pool, INITIAL, TRIALS)
            for seed in range(FIRST_TUNING, FIRST_TUNING + cell.runs):
                key = RunKey(method, seed)
                for _ in job.run(key, setup, environment):
                    pass
                kept[key] = folder.trials(key)
    summary = summarize(rows(kept), Reporting(INITIAL), np.random.default_rng(0))
    [gain] = [each for each in summary.differences if each.method == "svae-dc"]
    return {f"{part} {n}": getattr(gain.best[INITIAL + n - 1], part) for n in AFTER for part in PARTS}


def _digest(values: tuple[Any, ...]) -> str:
    return hashlib.sha256(repr(values).encode()).hexdigest()[:16]


def cells_of(base: Cell, total: int) -> dict[str, Cell]:
    """The base and every change of it, with halves and quarters of the episodes."""
    fewer = {f"{total // part:,} episodes": {"count": total // part} for part in (2, 4, 8)}
    return {label: replace(base, **change) for label, change in {**CHANGES, **fewer}.items()}


def draw(path: Path, found: Mapping[str, Result]) -> None:
    """The gain of every cell with its interval, after 10 and after 20 trials."""
    figure = Figure(figsize=(10, 0.32 * len(found) + 1.2), layout="constrained")
    places = np.arange(len(found))[::-1]
    for axes, after in zip(figure.subplots(1, len(AFTER), sharex=True, sharey=True), AFTER, strict=True):
        mean, low, high = ([result[f"{part} {after}"] for result in found.values()] for part in PARTS)
        axes.axvline(0, color="#8c8c8c", linewidth=0.8)
        axes.hlines(places, low, high, color="#d55e00", linewidth=2, alpha=0.6)
        axes.plot(mean, places, "o", color="#d55e00")
        axes.set_title(f"svae-dc − random, best after {after}", loc="left", fontsize=10)
        axes.set_yticks(places, list(found))
    figure.savefig(path, dpi=130)


def row(label: str, result: Result) -> Sequence[str]:
    """One line of the table."""
    gained = [
        f"{result[f'mean {n}']:+.3f} [{result[f'low {n}']:+.3f}, {result[f'high {n}']:+.3f}]" for n in AFTER
    ]
    return [label, *gained, f"{result['gen']:.3f}", f"{result['y']:.3f}"]


def main() -> None:
    """Compute the cells that are missing, then write the table and the figure."""
    parser = arguments(__doc__, "sensitivity")
    parser.add_argument("--updates", type=int, default=4_000)
    parser.add_argument("--runs", type=int, default=20)
    given = parser.parse_args()
    source = Source(str(Path(given.dataset).absolute()), given.cache)
    dataset, cache = source.opened()
    total = len(cache.training())
    base = Cell(dataset.fingerprint(), total, 1.0, SAME, given.updates, "paper", 5000, given.runs)
    cells = cells_of(base, total)
    cost = SECONDS_PER_UPDATE * given.updates + SECONDS_PER_TRIAL * given.runs * TRIALS
    out = given.out.absolute()
    computed = results(Study(out), list(cells.values()), partial(compute, source, out), cost, given.processes)
    found = dict(zip(cells, computed, strict=True))
    draw(out / "figure.png", found)
    head = ["change", *(f"svae-dc − random after {n}" for n in AFTER), "generated error", "y from x"]
    note = (
        f"\n{dataset.identity.setup}, fingerprint {dataset.fingerprint()[:12]}, {total} training episodes, "
        f"{given.updates} updates; {given.runs} paired runs on seeds from {FIRST_TUNING}, gap paper, pool of "
        f"5,000; 90 % bootstrap intervals. A rough G_bad is also what y is measured by.\n"
    )
    written(out / "table.md", table(head, [row(label, each) for label, each in found.items()]) + note)


if __name__ == "__main__":
    main()
