"""What reproducing a figure costs, step by step, before it is paid."""

import shutil
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path

from cluster.config import Settings
from cluster.costs import Cost, collecting, comparing, training
from cluster.progress import duration
from cluster.recipe import Panel
from cluster.reproduction import Reproduction
from cluster.results import RunKey, recorded


@dataclass(frozen=True)
class Item:
    """One step.

    Attributes:
        step: what is done.
        cost: of what is still to be done of it.
    """

    step: str
    cost: Cost


def bill(reproduction: Reproduction, settings: Settings, cores: int) -> list[Item]:
    """All steps of a reproduction, with what is left of each."""
    return [
        *_data(reproduction, settings, cores),
        *_models(reproduction, settings),
        *(_panel(reproduction, panel, settings) for panel in reproduction.recipe.panels),
    ]


def lines(reproduction: Reproduction, items: Sequence[Item], cores: int) -> Iterator[str]:
    """The bill in words.

    Args:
        reproduction: that is billed.
        items: its steps.
        cores: it will run on.
    """
    free = shutil.disk_usage(_existing(reproduction.folder)).free
    total = Item("in all", reduce(add, (item.cost for item in items), Cost()))
    yield f"{'still to do':<58} {'core-hours':>10} {'wall time':>12} {'disk, MB':>10}"
    for item in (*items, total):
        cost = item.cost
        yield (
            f"{item.step:<58} {cost.core_seconds / 3600:>10.2f} {duration(cost.seconds):>12} "
            f"{cost.size / 1e6:>10.0f}"
        )
    yield (
        f"on {cores} cores with nothing else to do, {free / 1e6:.0f} MB free; from costs that were measured "
        "elsewhere (docs/reproduction.md): `svaedc collect --plan` measures those of a dataset here"
    )


def _data(reproduction: Reproduction, settings: Settings, cores: int) -> Iterator[Item]:
    if not reproduction.trains:
        return
    setup, missing = reproduction.recipe.data, reproduction.missing_episodes()
    actors = settings.collect.actor_count(cores)
    step = f"collect {missing} of {reproduction.episodes} episodes of {setup}"
    yield Item(step, collecting(setup, missing, actors))


def _models(reproduction: Reproduction, settings: Settings) -> Iterator[Item]:
    for latent in reproduction.recipe.latents:
        preset = reproduction.scale.preset
        if reproduction.is_trained(latent):
            yield Item(f"train {latent}: there already", Cost())
            continue
        train = reproduction.training(settings.train, latent)
        updates = reproduction.updates(train)
        cache = reproduction.cache_size(train) if latent == reproduction.trains[0] else 0
        cost = training(reproduction.recipe.data, preset, latent, updates, cache)
        yield Item(f"train {latent}: {updates} updates, preset {preset}", cost)


def _panel(reproduction: Reproduction, panel: Panel, settings: Settings) -> Item:
    length = settings.compare.initial_trials + panel.trials
    folder = reproduction.comparison(panel)
    left = {name: sum(_missing(folder, name, reproduction.runs, length)) for name in panel.methods}
    cost = comparing(panel.setup, panel.methods, left, length, settings.compare.slots)
    runs = len(panel.methods) * reproduction.runs
    step = f"compare {panel.name}: {sum(left.values()):.0f} of {runs} runs of {length} trials"
    return Item(step, cost)


def _missing(folder: Path, method: str, runs: int, length: int) -> Iterator[float]:
    """The part that is missing of each run."""
    for run in range(runs):
        yield max(0.0, 1 - len(recorded(RunKey(method, run).path(folder))) / length)


def _existing(folder: Path) -> Path:
    return next(parent for parent in (folder, *folder.parents) if parent.exists())
