"""What reproducing a figure will do: the data and models it makes, those it was given, where all lies."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Final

from cluster.config import Settings, TrainSettings
from cluster.errors import UserError
from cluster.optimization.models import trained_model
from cluster.reproduction.recipe import NINE, Panel, Recipe, Training
from cluster.training.record import MEASURES
from svaedc.training.presets import Sizes, preset, usual_stride
from workers import setups
from workers.dataset.folder import Dataset, open_dataset
from workers.dataset.manifest import MANIFEST
from workers.dataset.storage.location import Location


@dataclass(frozen=True)
class Scale:
    """How much of the paper's data and training.

    Attributes:
        preset: of training.
        episodes: by setup.
    """

    preset: str
    episodes: Mapping[str, int]


_DATA = ("franka", "yumi", "daisy-27d", "daisy-11d")
SCALES: Final[Mapping[str, Scale]] = MappingProxyType(
    {
        "machine": Scale("compact", dict(zip(_DATA, (50_000, 20_000, 10_000, 10_000), strict=True))),
        "paper": Scale("paper", dict.fromkeys(_DATA, 500_000)),
    }
)
"""`paper` is that of sections 6.1 and 7.1, on a cluster with GPUs. `machine` takes an hour or two of two
cores."""


CANDIDATES, WORLDS, CANDIDATES_SEED = 2_000, 6, 1
"""So many candidates are simulated in so many worlds of each setup, for panels that choose among them."""


def scale(name: str) -> Scale:
    """The scale of that name.

    Raises:
        LookupError: there is none.
    """
    if name not in SCALES:
        raise LookupError(f"no scale called {name!r}; there are {', '.join(SCALES)}")
    return SCALES[name]


@dataclass(frozen=True)
class Reproduction:
    """A recipe at a scale, in a folder.

    Attributes:
        recipe: of the figure.
        scale: of data and training.
        folder: of everything; figures that need the same data or model share them there.
        episodes: that its models learn from.
        runs: of each method.
        dataset: folder of the episodes.
        collects: whether they are collected; if not, they were given, or every model was.
        models: folders by what they are trained for.
        trains: what is trained; the other models were given.
        results: folder of the figure.
    """

    recipe: Recipe
    scale: Scale
    folder: Path
    episodes: int
    runs: int
    dataset: Location
    collects: bool
    models: Mapping[Training, Path]
    trains: tuple[Training, ...]
    results: Path

    def comparison(self, panel: Panel) -> Path:
        """Folder of a panel's comparison."""
        return self.results / panel.name

    def candidates(self, panel: Panel) -> Path:
        """Folder of a panel's candidates, which panels that need the same ones share."""
        simulated = f"{'+'.join(panel.candidates)}-{CANDIDATES}x{WORLDS}"
        encoders = "+".join(path.name for path in self.models_of(panel))
        return self.folder / "candidates" / (f"{simulated}-by-{encoders}" if encoders else simulated)

    def models_of(self, panel: Panel) -> list[Path]:
        """Folders of a panel's models, in the order in which its runs take turns."""
        return [self.models[training] for training in panel.trainings]

    def missing_episodes(self) -> int:
        """Still to be collected."""
        if not self.collects:
            return 0
        begun = (self.dataset / MANIFEST).exists()
        done = _open(self.dataset, self.recipe.data).episodes() if begun else 0
        return max(0, self.episodes - done)

    def is_trained(self, training: Training) -> bool:
        """Whether this model was given, or is there as a whole."""
        return training not in self.trains or (self.models[training] / MEASURES).exists()

    def training(self, settings: TrainSettings, latent: str) -> TrainSettings:
        """Adapt the settings of training to a size of the latent path.

        Args:
            settings: of all trainings.
            latent: steps x dimensions.

        Returns:
            The same settings for `NINE`; otherwise a copy with that size.
        """
        return settings if latent == NINE else settings.model_copy(update={"latent": latent})

    def updates(self, settings: TrainSettings) -> int:
        """Gradient updates of one training."""
        training = preset(self.scale.preset)(self._sizes(settings)).training
        if settings.updates == "preset":
            return training.joint.updates + training.prior.updates
        return settings.updates

    def cache_size(self, settings: TrainSettings) -> int:
        """Bytes of the episodes that these settings decode, nearly all of them trajectories."""
        sizes = self._sizes(settings)
        return 4 * self.episodes * sizes.observation_dim * sizes.time_steps

    def _sizes(self, settings: TrainSettings) -> Sizes:
        setup = setups.load(self.recipe.data)
        stride = settings.stride_or(usual_stride(self.scale.preset))
        return Sizes(setup.dimensions, len(setup.observation), setup.horizon // stride)


def resolve(
    recipe: Recipe,
    scale: Scale,
    folder: Path,
    *,
    episodes: int,
    runs: int,
    dataset: Location | None,
    models: tuple[Path, ...],
) -> Reproduction:
    """Make every open choice of a reproduction.

    Args:
        recipe: of the figure.
        scale: of data and training.
        folder: of everything.
        episodes: to collect.
        runs: of each method.
        dataset: that is there already; None to collect one.
        models: that are there already; what each is for follows from its latent size, and of equal sizes from
            their order.

    Returns:
        What `run_steps` does.

    Raises:
        UserError: a dataset or model cannot be read, or is of another setup or size.
    """
    given = _given_models(recipe, models)
    trains = tuple(training for training in recipe.trainings if training not in given)
    if dataset is not None:
        episodes = _open(dataset, recipe.data).episodes()
    name = f"{recipe.data}-{episodes}"
    own = {each: folder / "models" / f"{name}-{scale.preset}-{each.name}" for each in trains}
    return Reproduction(
        recipe=recipe,
        scale=scale,
        folder=folder,
        episodes=episodes if trains else 0,
        runs=runs,
        dataset=dataset or folder / "data" / name,
        collects=bool(trains) and dataset is None,
        models={**given, **own},
        trains=trains,
        results=folder / recipe.figure,
    )


def cores(settings: Settings) -> int:
    """CPUs that a cluster started here would offer."""
    wanted = settings.ray.num_cpus
    return len(os.sched_getaffinity(0)) if wanted == "all" else wanted


def _open(folder: Location, setup: str) -> Dataset:
    try:
        dataset = open_dataset(folder)
    except (ValueError, OSError) as error:
        raise UserError(f"cannot use the dataset: {error}") from error
    if dataset.identity.setup != setup:
        raise UserError(
            f"{folder} holds episodes of {dataset.identity.setup!r}, this figure needs {setup!r}: "
            "name another --dataset, or leave it out to collect one"
        )
    return dataset


def _given_models(recipe: Recipe, models: tuple[Path, ...]) -> dict[Training, Path]:
    found: dict[Training, Path] = {}
    for folder in models:
        latent = _latent(folder, recipe.data)
        open_ones = [each for each in recipe.trainings if each.latent == latent and each not in found]
        if not open_ones:
            wanted = ", ".join(each.latent for each in recipe.trainings) or "none"
            raise UserError(
                f"{folder} has the latent size {latent}; {recipe.figure} takes one model of each of: {wanted}"
            )
        found[open_ones[0]] = folder
    return found


def _latent(folder: Path, setup: str) -> str:
    """Steps x dimensions of a model's latent path."""
    config = trained_model(folder, setup).model.config
    return f"{config.path_length}x{config.tau_dim}"
