"""The claims of the paper's appendix A: Laplace collapses less often than Gaussian; joint beats two stages.

Every arm maximises the plain bound, without this project's generation term. Two stages: an auto-encoder that
knows nothing of controllers first, and then p(tau, psi|x) alone, fitted to its posteriors. It is either a VAE
with a standard prior, or one without a KL term. `python -m studies.appendix_a --dataset data/franka`
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from statistics import mean, stdev
from typing import final

import torch
from jaxtyping import Float
from torch import Tensor, nn

from studies.cells import Result, Study, arguments, results, table, written
from studies.training import Source, begun, halves, measures, preset_for, train
from svaedc.model.distributions import FAMILIES, Diagonal
from svaedc.model.svae_dc import SvaeDc

SECONDS_PER_UPDATE = {"compact": 0.045, "paper": 0.15}
ARMS = (("laplace", "joint"), ("gaussian", "joint"), ("laplace", "standard"), ("laplace", "no-kl"))
ROWS = {
    "Laplace, joint": (("laplace", "joint"), "first"),
    "Gaussian, joint": (("gaussian", "joint"), "first"),
    "Laplace, joint, then p(τ,ψ\\|x) alone": (("laplace", "joint"), "last"),
    "Laplace, VAE with a standard prior, then p(τ,ψ\\|x)": (("laplace", "standard"), "last"),
    "Laplace, without KL, then p(τ,ψ\\|x)": (("laplace", "no-kl"), "last"),
}
"""By the label of a row: distribution and first stage, and after which stage its models are measured."""
COLUMNS = {
    "rec_norm": "reconstructed",
    "gen_norm": "generated",
    "corr_y_rec": "y rec",
    "corr_y_gen": "y gen",
    "active_dimensions": "active",
}


@dataclass(frozen=True)
class Cell:
    """One model.

    Attributes:
        fingerprint: of the dataset.
        count: of training episodes.
        networks: name of the preset.
        updates: of each stage.
        distribution: `laplace` or `gaussian`.
        stage: the first one, `joint`, `standard` or `no-kl`.
        seed: of weights, order and draws.
    """

    fingerprint: str
    count: int
    networks: str
    updates: int
    distribution: str
    stage: str
    seed: int


@final
class StandardPrior(nn.Module):
    """p(tau, psi) = standard, whatever the controller: the prior of a plain VAE."""

    def __init__(self, model: SvaeDc) -> None:
        """Take the place of the model's own."""
        super().__init__()
        self.size = model.config.latent_size
        self.family = FAMILIES[model.config.distribution]

    def forward(self, x: Float[Tensor, "batch controller"]) -> Diagonal:
        """The same for every controller."""
        return self.family(torch.zeros(len(x), self.size), torch.ones(len(x), self.size))


def compute(source: Source, cell: Cell) -> Result:
    """Train one model in its first stage and then p(tau, psi|x) alone; measure it after both."""
    dataset, cache = source.opened()
    training, held_out = halves(cache, cell.count)
    changes = {"distribution": cell.distribution, "weighting": "paper"}
    made = preset_for(cache, cell.networks, changes, cell.seed)
    settings = made.training
    if cell.stage == "no-kl":
        settings = replace(settings, weighting=replace(settings.weighting, kl=0.0))
    model = begun(made, training, dataset)
    own = model.prior_network
    if cell.stage == "standard":
        model.prior_network = StandardPrior(model)
    seconds = train(model, training, held_out, settings.with_updates(cell.updates, 0))
    model.prior_network = own
    first = measures(model, held_out)
    # As many updates as p(tau, psi|x) got in joint training; its best held-out epoch is kept.
    seconds += train(model, training, held_out, settings.with_updates(0, cell.updates))
    return {"first": first, "last": measures(model, held_out), "seconds": seconds}


def summarized(name: str, found: Sequence[Result]) -> list[str]:
    """One row: the share that collapsed, and mean and standard deviation over all seeds."""
    collapsed = sum(bool(result["collapsed"]) for result in found)
    cells = [f"{mean(values):.3f} ± {stdev(values):.3f}" for values in _columns(found)]
    return [name, f"{collapsed} of {len(found)}", *cells]


def _columns(found: Sequence[Result]) -> list[list[float]]:
    return [[float(result[name]) for result in found] for name in COLUMNS]


def main() -> None:
    """Compute the cells that are missing, then write the table."""
    parser = arguments(__doc__, "appendix-a")
    parser.add_argument("--episodes", type=int, default=8_000)
    parser.add_argument("--updates", type=int, default=1_500)
    parser.add_argument("--networks", choices=sorted(SECONDS_PER_UPDATE), default="compact")
    parser.add_argument("--seeds", type=int, default=5)
    given = parser.parse_args()
    source = Source(given.dataset, given.cache)
    dataset, cache = source.opened()
    halves(cache, given.episodes)
    what = (dataset.fingerprint(), given.episodes, given.networks, given.updates)
    # Seed by seed, so that an interrupted study has the same seeds of every arm.
    cells = {(arm, seed): Cell(*what, *arm, seed) for seed in range(given.seeds) for arm in ARMS}
    cost = SECONDS_PER_UPDATE[given.networks] * given.updates
    computed = results(
        Study(given.out), list(cells.values()), partial(compute, source), cost, given.processes
    )
    found = dict(zip(cells, computed, strict=True))
    rows = [
        summarized(label, [found[arm, seed][stage] for seed in range(given.seeds)])
        for label, (arm, stage) in ROWS.items()
    ]
    note = (
        f"\n{dataset.identity.setup}, fingerprint {dataset.fingerprint()[:12]}, the first {given.episodes} "
        f"training episodes, {len(cache.held_out())} held out; networks of `{given.networks}`, the plain "
        f"bound, {given.updates} updates of each stage, seeds 0 to {given.seeds - 1}; ± is the standard "
        "deviation.\n"
    )
    written(given.out / "table.md", table(["arm", "collapsed", *COLUMNS.values()], rows) + note)


if __name__ == "__main__":
    main()
