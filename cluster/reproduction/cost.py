"""What the steps of a reproduction cost, from costs of single episodes, updates and suggestions.

They are CPU times of one core, measured as docs/results/benchmarks.md says; another machine has other ones,
and `svaedc collect --plan` measures those of its own episodes.
"""

import shutil
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from operator import add
from pathlib import Path
from types import MappingProxyType
from typing import Final

from cluster.comparison.records import RunKey, read_trials
from cluster.config import Settings
from cluster.optimization.candidates import TABLE
from cluster.progress import duration
from cluster.reproduction.plan import CANDIDATES, WORLDS, Reproduction
from cluster.reproduction.recipe import Panel


@dataclass(frozen=True)
class Cost:
    """What something takes.

    Attributes:
        core_seconds: CPU time.
        seconds: wall time on so many cores, if nothing else needs them.
        size: bytes on disk.
    """

    core_seconds: float = 0.0
    seconds: float = 0.0
    size: float = 0.0

    def __add__(self, other: "Cost") -> "Cost":
        """One after the other."""
        return Cost(
            self.core_seconds + other.core_seconds, self.seconds + other.seconds, self.size + other.size
        )


@dataclass(frozen=True)
class _Episode:
    seconds: float
    size: int  # bytes


_EPISODES: Final[Mapping[str, _Episode]] = MappingProxyType(
    {
        "franka": _Episode(0.027, 23_800),
        "yumi": _Episode(0.064, 25_100),
        "yumi-rehearsal": _Episode(0.059, 13_800),
        "daisy-27d": _Episode(0.359, 75_000),
        "daisy-11d": _Episode(0.562, 117_500),
        "daisy-11d-rehearsal": _Episode(0.251, 45_800),
        "franka-mujoco": _Episode(0.006, 23_800),
        "yumi-mujoco": _Episode(0.011, 25_100),
        "daisy-27d-mujoco": _Episode(0.058, 75_000),
    }
)
_SUGGESTIONS: Final[Mapping[str, float]] = MappingProxyType(
    {"random": 0.0, "screened-random": 0.0, "matern": 0.083, "se-acqf": 0.165, "botorch": 0.35, "bbk-kl": 0.1}
)
_USUAL_SUGGESTION = 0.05  # s, of a method that searches its pool, at 22 trials
_BEGINNINGS: Final[Mapping[str, float]] = MappingProxyType({"bbk-kl": 3.6})
_READING_PLANS: Final = 0.123
"""It is what p(tau, psi|x) costs on top where it reads plans, as measured on the Franka."""
_UPDATES: Final[Mapping[tuple[str, str, str], float]] = MappingProxyType(
    {
        ("franka", "compact", "3x3"): 0.037 + _READING_PLANS,
        ("franka", "compact", "5x6"): 0.058 + _READING_PLANS,
        ("yumi", "compact", "3x3"): 0.059 + _READING_PLANS,
        ("daisy-27d", "compact", "3x3"): 0.069 + _READING_PLANS,
        ("daisy-11d", "compact", "3x3"): 0.086 + _READING_PLANS,
        ("franka", "paper", "3x3"): 0.45,
        ("franka", "paper", "5x6"): 2.1,
        ("yumi", "paper", "3x3"): 0.69,
        ("daisy-27d", "paper", "3x3"): 0.99,
        ("daisy-11d", "paper", "3x3"): 1.9,
    }
)
_ROW = 400  # bytes of one trial in its run's record


def collecting(setup: str, episodes: int, cores: int) -> Cost:
    """Estimate what rolling out and storing episodes costs.

    Args:
        setup: whose episodes.
        episodes: how many.
        cores: that roll out at the same time.

    Returns:
        CPU time, wall time on those cores, and bytes of the episodes.
    """
    one = _EPISODES[setup]
    seconds = one.seconds * episodes
    return Cost(seconds, seconds / cores, float(one.size * episodes))


def training(setup: str, preset: str, latent: str, updates: int, cache: int) -> Cost:
    """Estimate what gradient updates cost on one thread; a GPU or further threads make them faster.

    Args:
        setup: whose episodes.
        preset: of training.
        latent: size of the latent path.
        updates: of all stages.
        cache: bytes of the decoded episodes.

    Returns:
        CPU time, as much wall time, and bytes of the cache.
    """
    seconds = _UPDATES[setup, preset, latent] * updates
    return Cost(seconds, seconds, float(cache))


def comparing(setup: str, methods: Iterable[str], runs: Mapping[str, float], trials: int, slots: int) -> Cost:
    """Estimate what simulated runs cost, with what their methods think between trials.

    Args:
        setup: whose trials; one without a simulator costs nothing.
        methods: compared.
        runs: still to be done of each method; a part of one counts as such.
        trials: of a run, the random ones included.
        slots: runs at the same time.

    Returns:
        CPU time, wall time over the slots, and bytes of the runs' records.
    """
    episode = _EPISODES[setup].seconds if setup in _EPISODES else 0.0
    seconds = sum(
        runs[name]
        * (_BEGINNINGS.get(name, 0.0) + trials * (episode + _SUGGESTIONS.get(name, _USUAL_SUGGESTION)))
        for name in methods
    )
    return Cost(seconds, seconds / slots, sum(runs.values()) * trials * _ROW)


@dataclass(frozen=True)
class Item:
    """One step.

    Attributes:
        step: what is done.
        cost: of what is still to be done of it.
    """

    step: str
    cost: Cost


def cost_items(reproduction: Reproduction, settings: Settings, cores: int) -> list[Item]:
    """List all steps of a reproduction, with what is left of each.

    Args:
        reproduction: that is billed.
        settings: of all steps.
        cores: it will run on.

    Returns:
        Data, models and panels, in this order.
    """
    return [
        *_data(reproduction, settings, cores),
        *_models(reproduction, settings),
        *_candidates(reproduction, settings, cores),
        *(_panel(reproduction, panel, settings) for panel in reproduction.recipe.panels),
    ]


def lines(reproduction: Reproduction, items: Sequence[Item], cores: int) -> Iterator[str]:
    """Put the cost into words.

    Args:
        reproduction: that is billed.
        items: its steps.
        cores: it will run on.

    Yields:
        A heading, a line for each step and one for all of them, and a remark on the machine.
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
        "elsewhere (docs/results/reproduction.md): `svaedc collect --plan` measures those of a dataset here"
    )


def _data(reproduction: Reproduction, settings: Settings, cores: int) -> Iterator[Item]:
    if not reproduction.trains:
        return
    setup, missing = reproduction.recipe.data, reproduction.missing_episodes()
    actors = settings.collect.actor_count(cores)
    step = f"collect {missing} of {reproduction.episodes} episodes of {setup}"
    yield Item(step, collecting(setup, missing, actors))


def _models(reproduction: Reproduction, settings: Settings) -> Iterator[Item]:
    for wanted in reproduction.recipe.trainings:
        preset = reproduction.scale.preset
        if reproduction.is_trained(wanted):
            yield Item(f"train {wanted.name}: there already", Cost())
            continue
        train = reproduction.training(settings.train, wanted.latent)
        updates = reproduction.updates(train)
        cache = reproduction.cache_size(train) if wanted == reproduction.trains[0] else 0
        cost = training(reproduction.recipe.data, preset, wanted.latent, updates, cache)
        yield Item(f"train {wanted.name}: {updates} updates, preset {preset}", cost)


def _candidates(reproduction: Reproduction, settings: Settings, cores: int) -> Iterator[Item]:
    """Those that are not there, each once."""
    wanted = {
        reproduction.candidates(panel): panel for panel in reproduction.recipe.panels if panel.candidates
    }
    for folder, panel in wanted.items():
        if (folder / TABLE).exists():
            yield Item(f"candidates in {', '.join(panel.candidates)}: there already", Cost())
            continue
        actors, episodes = settings.collect.actor_count(cores), CANDIDATES * WORLDS
        costs = (collecting(setup, episodes, actors) for setup in panel.candidates)
        step = f"candidates in {', '.join(panel.candidates)}: {CANDIDATES} x {WORLDS} episodes"
        yield Item(step, reduce(add, costs, Cost()))


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
        yield max(0.0, 1 - len(read_trials(RunKey(method, run).path(folder))) / length)


def _existing(folder: Path) -> Path:
    return next(parent for parent in (folder, *folder.parents) if parent.exists())
