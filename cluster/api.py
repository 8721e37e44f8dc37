"""The commands as functions, for notebooks and scripts; `import svaedc` offers them by these names.

Each function does what the command of its name does, with the same settings and the same records: a dataset,
model or comparison may be begun by one and continued by the other.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from cluster.candidates.plan import plan_candidates
from cluster.candidates.simulate import simulate
from cluster.comparison import compare as comparison_driver
from cluster.comparison.compare import Comparison
from cluster.comparison.plan import Grid, plan_comparison
from cluster.config import Settings
from cluster.datasets import collect as collection_driver
from cluster.datasets.plan import plan_collection, say_complete
from cluster.errors import UserError
from cluster.inputs import dataset_location, durable_dataset, require_working_setup, setup_of
from cluster.optimization import methods as known_methods
from cluster.optimization.candidates import CandidateTable, read
from cluster.optimization.factory import hidden_robot
from cluster.optimization.models import TrainedModel, load_model
from cluster.services import services
from cluster.settings import load_settings
from cluster.training import train as training_driver
from svaedc.bo.loop import Outcome
from workers.dataset import folder as dataset_folder
from workers.dataset.folder import Dataset
from workers.rollout import rollout
from workers.setups import SETUPS, Setup

METHODS = ("random", "screened-random", "se", "svae", "svae-dc")
"""What `compare` compares unless it is told otherwise."""
AS_CONFIGURED: Mapping[str, Any] = {}
"""No setting is changed."""
Models = Path | str | Sequence[Path | str] | None
"""These are folders of trained models: one, several or none."""


def setup_names() -> tuple[str, ...]:
    """The setups that ship; the name of an importable module that offers `setup()` is one as well."""
    return tuple(SETUPS)


def load_setup(name: str) -> Setup:
    """The setup of that name.

    Raises:
        UsageError: there is none; the message names the nearest.
    """
    return setup_of(name)


def method_names() -> tuple[str, ...]:
    """The methods that `compare` and `Optimizer` know."""
    return known_methods.names()


def open_dataset(dataset: Path | str) -> Dataset:
    """A dataset that was collected.

    Args:
        dataset: its folder, or `s3://bucket/prefix`.

    Returns:
        The dataset; `read(shard)` gives the episodes of one of its `shards()` as arrays.

    Raises:
        UserError: there is none.
    """
    try:
        return dataset_folder.open_dataset(dataset_location(str(dataset)))
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error


def collect(
    setup: Setup | str,
    dataset: Path | str,
    episodes: int,
    *,
    seed: int = 0,
    repeats: int = 1,
    gap: str = "",
    settings: Mapping[str, Any] = AS_CONFIGURED,
    address: str | None = None,
) -> Dataset:
    """Roll out random controllers into a dataset; what it holds already is kept.

    Args:
        setup: whose controllers, or its name. Rollout processes import it by its name.
        dataset: its folder, or `s3://bucket/prefix`.
        episodes: that it shall hold.
        seed: of all controllers and physics.
        repeats: episodes of each controller, each under other physics.
        gap: level that the physics are drawn from, or its ranges; "" for those of data collection.
        settings: any of `ray_config.yaml`, by `section.key`.
        address: of a running Ray cluster; None starts one here.

    Returns:
        The dataset.

    Raises:
        UserError: as `svaedc collect` says it.
    """
    chosen, known = require_working_setup(_setup(setup), seed), _settings(settings)
    plan = plan_collection(
        setup=chosen,
        episodes=episodes,
        folder=durable_dataset(str(dataset)),
        seed=seed,
        repeats=repeats,
        gap=gap,
        settings=known.collect,
    )
    if not plan.missing:
        say_complete(plan)
        return plan.dataset
    with services(known, address, parts=()) as (session, tracker):
        return collection_driver.collect(plan, known.collect, session, tracker)


def train(
    dataset: Path | str,
    model: Path | str,
    *,
    preset: str = "compact",
    seed: int = 0,
    settings: Mapping[str, Any] = AS_CONFIGURED,
    address: str | None = None,
) -> TrainedModel:
    """Fit the SVAE-DC to a dataset; an interrupted training goes on.

    Args:
        dataset: its folder, or `s3://bucket/prefix`.
        model: folder of the model.
        preset: `compact` (two CPU cores, minutes) or `paper` (a GPU, hours).
        seed: of every draw.
        settings: any of `ray_config.yaml`, by `section.key`.
        address: of a running Ray cluster; None starts one here.

    Returns:
        The model.

    Raises:
        UserError: as `svaedc train` says it.
    """
    known = _settings(settings)
    with services(known, address) as (session, tracker):
        path = training_driver.train(
            folder=durable_dataset(str(dataset)),
            model=Path(model).absolute(),
            preset=preset,
            seed=seed,
            settings=known.train,
            session=session,
            tracker=tracker,
        )
    return load_model(path)


def compare(
    setup: Setup | str,
    out: Path | str,
    *,
    methods: tuple[str, ...] = METHODS,
    model: Models = (),
    runs: int = 50,
    trials: int = 20,
    gap: str = "paper",
    seed: int = 0,
    candidates: Path | str | None = None,
    settings: Mapping[str, Any] = AS_CONFIGURED,
    address: str | None = None,
) -> Comparison:
    """Run methods side by side in simulation; what the folder holds already is kept.

    Args:
        setup: whose controllers, or its name. Processes that run trials import it by its name.
        out: folder of the results.
        methods: names; see `method_names`.
        model: folder of a model of this setup, where methods need one; with several, runs take turns.
        runs: seeds of each method.
        trials: suggested in each run, after the random ones.
        gap: hidden physics: `paper`, `training`, `wide`, or ranges written out.
        seed: of the first run.
        candidates: folder that `simulate_candidates` left, to choose among; None to draw them.
        settings: any of `ray_config.yaml`, by `section.key`.
        address: of a running Ray cluster; None starts one here.

    Returns:
        The summary of all runs in the folder, and the address of the MLflow run.

    Raises:
        UserError: as `svaedc compare` says it.
    """
    known = _settings(settings)
    plan = plan_comparison(
        setup=_setup(setup),
        grid=Grid(methods, seed, runs),
        trials=trials,
        gap=gap,
        models=_folders(model),
        folder=Path(out).absolute(),
        settings=known.compare,
        candidates=None if candidates is None else Path(candidates).absolute(),
    )
    with services(known, address) as (session, tracker):
        return comparison_driver.compare(plan, session, tracker)


def simulate_candidates(
    setup: Setup | str,
    out: Path | str,
    *,
    model: Models = (),
    count: int = 2000,
    episodes: int = 6,
    gap: str = "wide",
    seed: int = 1,
    settings: Mapping[str, Any] = AS_CONFIGURED,
    address: str | None = None,
) -> CandidateTable:
    """Simulate controllers under several physics each, before any is tried; what the folder holds is kept.

    Args:
        setup: whose controllers, or its name. Rollout processes import it by its name.
        out: folder of the candidates.
        model: folder of a model of this setup, which encodes the episodes; there may be several, or none.
        count: how many candidates.
        episodes: of each, under different physics.
        gap: level that the physics are drawn from, or its ranges.
        seed: of all draws.
        settings: any of `ray_config.yaml`, by `section.key`.
        address: of a running Ray cluster; None starts one here.

    Returns:
        What simulation showed of every candidate.

    Raises:
        UserError: as `svaedc candidates` says it.
    """
    known = _settings(settings)
    plan = plan_candidates(
        setups=[require_working_setup(_setup(setup), seed)],
        count=count,
        episodes=episodes,
        gap=gap,
        seed=seed,
        models=_folders(model),
        chosen=None,
        folder=Path(out).absolute(),
        settings=known.collect,
    )
    if plan.is_whole:
        return read(plan.table)
    with services(known, address, parts=()) as (session, tracker):
        return simulate(plan, known.collect, session, tracker)


@contextmanager
def simulated_robot(setup: Setup | str, gap: str = "paper", seed: int = 0) -> Iterator[Any]:
    """A robot to try controllers on: the setup under hidden physics that are drawn once.

    Args:
        setup: whose controllers, or its name.
        gap: hidden physics: `paper`, `training`, `wide`, or ranges written out.
        seed: of the draw; that of a run of `compare` gives its physics.

    Yields:
        A function of a controller, [D] in the unit cube, that returns its `f`, `y`, `success` and `stop`.
    """
    chosen = _setup(setup)
    with chosen.open() as environment:
        evaluate = hidden_robot(chosen, partial(rollout, chosen, environment), gap, seed)

        def evaluate_array(x: np.ndarray) -> Outcome:
            return evaluate(np.asarray(x, dtype=np.float32))

        yield evaluate_array


def _setup(setup: Setup | str) -> Setup:
    return setup_of(setup) if isinstance(setup, str) else setup


def _folders(models: Models) -> list[Path]:
    given = [models] if isinstance(models, str | Path) else models or ()
    return [Path(model).absolute() for model in given]


def _settings(changes: Mapping[str, Any]) -> Settings:
    """The settings of the working directory's file, changed; values are written as `--set` takes them."""
    return load_settings(None, [f"{name}={value}" for name, value in changes.items()])
