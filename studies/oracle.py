"""How much better p(tau, psi|x) must get: Bayesian optimisation on features that know more and more.

Candidates are held-out episodes, so nothing is simulated. Their latent code is that of p(tau, psi|x), or of
q(tau, psi|xi, y), which has seen the trajectory itself and so is an oracle, or a mean of both.
`python -m studies.oracle --dataset data/franka --model models/franka`
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
import torch
from jaxtyping import Float, Float32
from matplotlib.figure import Figure
from torch import Tensor

from cluster.comparison.figure import STYLES
from cluster.training.worker import episodes
from studies.cells import Result, Study, arguments, results, table, written
from studies.training import Source
from svaedc.analysis.statistics import Estimate, bootstrap
from svaedc.bo import methods
from svaedc.bo.candidates import Problem, as_they_are
from svaedc.bo.features import LatentMeans, Latents
from svaedc.bo.loop import trials
from svaedc.bo.offline import INITIAL, Recorded
from svaedc.data.episodes import Batch, Episodes, measure_batches
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc
from workers import setups
from workers.dataset.cache import TrainingCache
from workers.dataset.shards import sha256

AFTER = (10, 20)
SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
METHODS = ("svae", "svae-dc", "svae-dc-whitened", "screened-svae", "screened-random")
RANDOM: Final = "random"
SECONDS_PER_TRIAL = 0.05


@dataclass(frozen=True)
class Cell:
    """Runs of one method on one kind of features.

    Attributes:
        model: SHA-256 of the checkpoint.
        fingerprint: of the dataset.
        candidates: held-out episodes to choose from.
        runs: with other first trials each.
        method: its name.
        share: of the oracle in the latent code.
    """

    model: str
    fingerprint: str
    candidates: int
    runs: int
    method: str
    share: float


def compute(source: Source, model_path: Path, cell: Cell) -> Result:
    """The best objective of each run after some trials, and how well the features tell trajectories."""
    torch.set_num_threads(1)
    dataset, cache = source.opened()
    model, _ = checkpoint.load(model_path)
    chosen = candidates(cache, cell.candidates)
    known = codes(model.eval(), chosen, cell.share)
    limits = setups.load(dataset.identity.setup).objective_limits
    pool = Recorded(np.asarray(cache.x[chosen.rows]), np.asarray(cache.f[chosen.rows]), limits)
    latent_means = looked_up(pool.x, known["tau"], known["y"])
    best = [_best(cell.method, pool, latent_means, run) for run in range(cell.runs)]
    kept = {f"best {n}": [each[INITIAL + n - 1] for each in best] for n in AFTER}
    error = (known["error"].mean(0) / known["median"].mean(0))[known["median"].mean(0) > 0].mean()
    truth = torch.from_numpy(np.asarray(chosen.y[chosen.rows]))
    corr = torch.corrcoef(torch.stack([truth, known["y"]]))[0, 1]
    return {**kept, "error": float(error), "corr_y": float(corr)}


def candidates(cache: TrainingCache, count: int) -> Episodes:
    """The first held-out episodes."""
    _, held_out = episodes(cache)
    return replace(held_out, rows=held_out.rows[:count])


def codes(model: SvaeDc, chosen: Episodes, share: float) -> dict[str, Tensor]:
    """Latent paths, badness, and what decoding the paths errs by, per channel, beside the per-step median."""

    def measure(batch: Batch) -> dict[str, Tensor]:
        x, xi, bad, y = batch
        code = (1 - share) * model.prior(x).loc + share * model.posterior(xi, bad, y).loc
        tau, psi = model.split(code)
        scaled = model.normaliser.normalize(xi)
        return {
            "tau": tau,
            "y": model.badness_at(psi).clamp(0, 1),
            "error": (model.p_xi(tau).loc - scaled).abs().mean(-1),
            "median": (model.normaliser.median - scaled).abs().mean(-1),
        }

    return measure_batches(chosen, torch.device("cpu"), measure)


def looked_up(
    x: Float32[np.ndarray, "n D"], tau: Float[Tensor, "n k"], y: Float[Tensor, " n"]
) -> LatentMeans:
    """A model that knows these controllers only."""
    rows = {each.tobytes(): index for index, each in enumerate(x)}

    def means(wanted: Tensor) -> tuple[Tensor, Tensor]:
        found = [rows[each.tobytes()] for each in wanted.detach().numpy()]
        return tau[found], y[found]

    return means


def _best(method: str, pool: Recorded, latent_means: LatentMeans, run: int) -> list[float]:
    latents = Latents.of(torch.from_numpy(pool.x), latent_means)
    problem = Problem(pool.x.shape[1], pool.limits, pool.x, latents)
    first = pool.x[np.random.default_rng((run, 0)).choice(len(pool.x), INITIAL, replace=False)]
    # Nothing is known of controllers between the candidates, where `random` would draw.
    drawn = methods.PoolSearch(as_they_are(problem)) if method == RANDOM else methods.build(method, problem)
    records = trials(
        drawn,
        pool.outcome,
        first,
        max(AFTER),
        lambda index: np.random.default_rng((run, 1, index)),
        lambda: 0.0,
    )
    return [trial.best for trial in records]


def gain(ours: Result, theirs: Result, after: int) -> Estimate:
    """Mean and interval of the paired difference."""
    differences = np.array(ours[f"best {after}"]) - np.array(theirs[f"best {after}"])
    [found] = bootstrap(differences[:, None], 0.9, np.random.default_rng(0))
    return found


def draw(path: Path, found: Mapping[tuple[str, float], Result]) -> None:
    """Best objective after 10 and 20 trials over the error of the features, one curve for each method."""
    figure = Figure(figsize=(10, 4), layout="constrained")
    errors = [found[METHODS[0], share]["error"] for share in SHARES]
    for axes, after in zip(figure.subplots(1, len(AFTER), sharey=True), AFTER, strict=True):
        for method in METHODS:
            color, marker, line = STYLES[method]
            means = [np.mean(found[method, share][f"best {after}"]) for share in SHARES]
            axes.plot(errors, means, color=color, marker=marker, linestyle=line, label=method)
        axes.axhline(np.mean(found[RANDOM, 0.0][f"best {after}"]), color="#8c8c8c", ls=":", label=RANDOM)
        axes.invert_xaxis()
        axes.set_title(f"mean best objective after {after} trials", loc="left", fontsize=10)
    figure.supxlabel("error of the decoded features, relative to the per-step median", fontsize=10)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside right upper", frameon=False, fontsize=8)
    figure.savefig(path, dpi=130)


def rows_of(found: Mapping[tuple[str, float], Result]) -> list[list[str]]:
    """One line for each method and share of the oracle."""
    lines = []
    for (method, share), result in found.items():
        gains = [
            gain(result, other, after)
            for other in (found[RANDOM, 0.0], found["screened-random", share if method != RANDOM else 0.0])
            for after in AFTER
        ]
        texts = [f"{each.mean:+.3f} [{each.low:+.3f}, {each.high:+.3f}]" for each in gains]
        lines.append([method, f"{share:.0%}", f"{result['error']:.2f}", f"{result['corr_y']:.2f}", *texts])
    return lines


def main() -> None:
    """Compute the cells that are missing, then write the table and the figure."""
    parser = arguments(__doc__, "oracle")
    parser.add_argument("--model", type=Path, required=True)
    parser.add_argument("--candidates", type=int, default=2_000)
    parser.add_argument("--runs", type=int, default=50)
    given = parser.parse_args()
    source = Source(given.dataset, given.cache)
    dataset, _ = source.opened()
    path = checkpoint.checkpoint_path(given.model)
    what = (sha256(path), dataset.fingerprint(), given.candidates, given.runs)
    kinds = [(RANDOM, 0.0), *((method, share) for share in SHARES for method in METHODS)]
    cells = [Cell(*what, *kind) for kind in kinds]
    cost = SECONDS_PER_TRIAL * given.runs * max(AFTER)
    computed = results(Study(given.out), cells, partial(compute, source, path), cost, given.processes)
    found = dict(zip(kinds, computed, strict=True))
    draw(given.out / "figure.png", found)
    against = [f"− {name} after {n}" for name in (RANDOM, "screened-random") for n in AFTER]
    note = (
        f"\n{dataset.identity.setup}, model {what[0][:12]}, {given.candidates} held-out episodes as "
        f"candidates, each under physics of its own; {given.runs} paired runs, 90 % bootstrap intervals. "
        "`error` is that of trajectories decoded from the features, against the per-step median; `y` is the "
        "correlation of predicted and true badness.\n"
    )
    written(
        given.out / "table.md", table(["method", "oracle", "error", "y", *against], rows_of(found)) + note
    )


if __name__ == "__main__":
    main()
