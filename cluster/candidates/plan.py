"""Which candidates are simulated, where, and what is missing of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float32

from cluster.config import CollectSettings
from cluster.datasets.plan import CollectionPlan, plan_collection
from cluster.errors import UsageError, UserError
from cluster.optimization.candidates import TABLE, origin_of, parameters_of
from cluster.optimization.models import TrainedModel, trained_model
from workers.collection.choice import Keep, chosen_controllers
from workers.collection.twins import SAME, require_comparable
from workers.dataset.folder import open_dataset
from workers.dataset.shards import sha256
from workers.dataset.storage.location import Location
from workers.draws import REPEAT
from workers.rollout import VERSION
from workers.setups import Setup


@dataclass(frozen=True)
class CandidatesPlan:
    """Candidates before they are simulated.

    Attributes:
        folder: of everything.
        setups: they are simulated in; all take the same controllers.
        collections: of their episodes, one of each setup.
        episodes: of each candidate in each setup.
        models: encode the episodes.
        origin: what the table will say of itself, but for its fingerprints.
    """

    folder: Path
    setups: tuple[Setup, ...]
    collections: tuple[CollectionPlan, ...]
    episodes: int
    models: tuple[TrainedModel, ...]
    origin: Mapping[str, Any]

    @property
    def table(self) -> Path:
        """Where the table lies."""
        return self.folder / TABLE

    @property
    def is_whole(self) -> bool:
        """Whether the table of just these candidates is there."""
        return dict(origin_of(self.table)) == self.full_origin()

    def full_origin(self) -> dict[str, Any]:
        """The origin, with the fingerprints of the episodes that are there."""
        prints = {plan.dataset.identity.setup: plan.dataset.fingerprint() for plan in self.collections}
        return {**self.origin, "fingerprints": prints}


def plan_candidates(
    *,
    setups: Sequence[Setup],
    count: int,
    episodes: int,
    gap: str,
    seed: int,
    models: Sequence[Path],
    chosen: Float32[np.ndarray, "c d"] | None,
    folder: Path,
    settings: CollectSettings,
) -> CandidatesPlan:
    """Decide which candidates are simulated, and begin the datasets of their episodes.

    All candidates are simulated in the same worlds: the first episodes of all have the same physics, and so
    do all further ones.

    Args:
        setups: in which they are simulated, at least one; more must take the same controllers.
        count: candidates, those that are chosen included.
        episodes: of each in each setup.
        gap: level that the physics are drawn from, or its ranges.
        seed: of candidates and physics.
        models: folders of those that encode the episodes.
        chosen: candidates that come first; None where all are drawn.
        folder: of everything; each setup's episodes are a dataset in it, named after the setup.
        settings: of the collection.

    Returns:
        The plan.

    Raises:
        UsageError: the setups differ in their controllers, there is no such gap, or fewer candidates are
            asked for than are chosen.
        UserError: the folder holds other candidates, or a model is of another robot.
    """
    _require_one_robot(setups)
    if chosen is not None and len(chosen) > count:
        raise UsageError(
            f"--count must be at least the {len(chosen)} controllers that are chosen, got {count}"
        )
    found = tuple(_model(model, setups) for model in models)
    plans = tuple(
        plan_collection(
            setup=setup,
            episodes=count * episodes,
            folder=folder / setup.name,
            seed=seed,
            settings=settings,
            repeats=episodes,
            gap=gap,
            physics_of=REPEAT,
            chosen=chosen,
        )
        for setup in setups
    )
    return CandidatesPlan(
        folder=folder,
        setups=tuple(setups),
        collections=plans,
        episodes=episodes,
        models=found,
        origin=_origin(plans, setups, count, episodes, found),
    )


def _origin(
    plans: Sequence[CollectionPlan],
    setups: Sequence[Setup],
    count: int,
    episodes: int,
    models: Sequence[TrainedModel],
) -> dict[str, Any]:
    identity = plans[0].dataset.identity
    draws = plans[0].dataset.draws()
    return {
        "setups": [setup.name for setup in setups],
        "setup_digests": [setup.code for setup in setups],
        "rollout_version": VERSION,
        "parameters": parameters_of(setups[0]),
        "gap": identity.gap,
        "count": count,
        "chosen": 0 if draws.chosen is None else len(draws.chosen),
        "seed": identity.seed,
        "conditions": list(setups[0].conditions),
        "worlds": [
            {"setup": setup.name, **draws.physics(setup.gap(identity.gap), number)}
            for setup in setups
            for number in range(episodes)
        ],
        "models": {sha256(each.path): each.model.config.tau_size for each in models},
    }


def _require_one_robot(setups: Sequence[Setup]) -> None:
    first, *others = setups
    for other in others:
        try:
            require_comparable(first, other, SAME)
        except ValueError as error:
            raise UsageError(str(error)) from error
        if first.conditions != other.conditions:
            raise UsageError(
                f"{first.name} and {other.name} must have the same bad conditions, got "
                f"{', '.join(first.conditions)} and {', '.join(other.conditions)}"
            )


def _model(model: Path, setups: Sequence[Setup]) -> TrainedModel:
    for setup in setups[1:]:
        trained_model(model, setup.name)
    return trained_model(model, setups[0].name)


def stride_of(model: TrainedModel) -> int:
    """Control steps between two samples of what a model has learnt from."""
    return int(model.metadata["stride"])


def choose(place: Location, setup: Setup, keep: Keep, count: int) -> Float32[np.ndarray, "c d"]:
    """Choose candidates among the controllers of a dataset.

    Args:
        place: of the dataset.
        setup: that must have its controllers.
        keep: which of them.
        count: how many; fewer where there are fewer.

    Returns:
        The controllers, the first first, [c, D].

    Raises:
        UserError: it cannot be read, or its controllers are others.
    """
    try:
        dataset = open_dataset(place)
        own = tuple((p.name, p.low, p.high) for p in setup.controller.parameters)
        if dataset.identity.parameters != own:
            raise UserError(
                f"the controllers of {place} ({dataset.identity.setup}) are not those of {setup.name}: "
                "choose among a dataset of the same robot"
            )
        return chosen_controllers(dataset, keep, count)
    except (ValueError, OSError) as error:
        raise UserError(f"cannot choose among the controllers of {place}: {error}") from error
