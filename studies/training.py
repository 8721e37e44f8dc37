"""A model of a study: trained in this process by the loop that Ray Train runs, measured on held-out data."""

import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import torch

from cluster.training.worker import episodes
from svaedc.bo.offline import Recorded, worth
from svaedc.data.episodes import Episodes
from svaedc.model.diagnostics import collapse, evaluate
from svaedc.model.svae_dc import SvaeDc, initialized_model
from svaedc.training.config import TrainingSettings
from svaedc.training.loop import fit
from svaedc.training.presets import Preset, Sizes, preset, vary
from workers import setups
from workers.dataset.cache import TrainingCache, training_cache
from workers.dataset.folder import Dataset, open_dataset

KEPT = ("rec_norm", "gen_norm", "corr_y_rec", "corr_y_gen", "active_dimensions", "elbo")
RUNS, TRIALS, CANDIDATES = 20, 10, 2_000
"""Of Bayesian optimisation whose candidates are held-out episodes, as in `svaedc train --sweep`."""


@dataclass(frozen=True)
class Source:
    """Where the episodes of a study come from.

    Attributes:
        dataset: its folder.
        cache: folder of training caches.
        stride: of the training.
    """

    dataset: str
    cache: str
    stride: int = 5

    def opened(self) -> tuple[Dataset, TrainingCache]:
        """The dataset and its cache, decoded now if it is not there."""
        dataset = open_dataset(Path(self.dataset))
        return dataset, training_cache(dataset, self.stride, Path(self.cache))


def halves(cache: TrainingCache, count: int) -> tuple[Episodes, Episodes]:
    """The first `count` training episodes, so that larger selections hold the smaller; all held-out ones."""
    training, held_out = episodes(cache)
    if count > len(training):
        raise ValueError(f"there are {len(training)} training episodes, got a count of {count}; collect more")
    return replace(training, rows=training.rows[:count]), held_out


def preset_for(cache: TrainingCache, name: str, changes: Mapping[str, Any], seed: int) -> Preset:
    """A preset with some of its choices changed, for the sizes of a cache."""
    sizes = Sizes(cache.x.shape[1], *cache.xi.shape[1:])
    made = vary(preset(name)(sizes), changes)
    return made._replace(training=replace(made.training, seed=seed))


def begun(made: Preset, training: Episodes, dataset: Dataset) -> SvaeDc:
    """The model before its first update; one thread from here on."""
    torch.set_num_threads(1)
    low, high = ([channel[index] for channel in dataset.identity.observation] for index in (2, 3))
    return initialized_model(made.model, training, (low, high), made.training.seed)


def train(model: SvaeDc, training: Episodes, held_out: Episodes, settings: TrainingSettings) -> float:
    """Train a model in place; returns CPU seconds."""
    begin = time.process_time()
    for _ in fit(model, training, held_out, settings):
        pass
    return time.process_time() - begin


def measures(model: SvaeDc, held_out: Episodes) -> dict[str, Any]:
    """The diagnostics on all held-out episodes, and why the model collapsed, or ""."""
    found = evaluate(model, held_out)
    return {name: found[name] for name in KEPT} | {"collapsed": collapse(found) or ""}


def worths(model: SvaeDc, dataset: Dataset, cache: TrainingCache, held_out: Episodes) -> dict[str, float]:
    """What the model is worth for Bayesian optimisation among held-out episodes."""
    rows = held_out.rows[:CANDIDATES]
    limits = setups.load(dataset.identity.setup).objective_limits
    recorded = Recorded(np.asarray(cache.x[rows]), np.asarray(cache.f[rows]), limits)
    frozen = model.eval().requires_grad_(requires_grad=False)
    found = {}
    for method in ("svae-dc", "screened-random"):
        values = asdict(worth(method, recorded, frozen.latent_means, RUNS, TRIALS))
        found |= {f"{method} {name}": value for name, value in values.items()}
    return found
