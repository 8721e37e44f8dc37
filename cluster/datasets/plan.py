"""What a collection will do, decided before Ray or MLflow is loaded: a whole dataset costs neither."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float32

from cluster.config import CollectSettings
from cluster.datasets.quarantine import release
from cluster.errors import UserError
from cluster.inputs import usage_errors
from cluster.progress import say
from workers.dataset import shards
from workers.dataset.chosen import chosen_digest
from workers.dataset.folder import Dataset, create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.location import Location
from workers.draws import EPISODE
from workers.setups import Setup


@dataclass(frozen=True)
class CollectionPlan:
    """What is missing of a dataset.

    Attributes:
        dataset: begun, if it was not there.
        episodes: that it shall hold.
        missing: shards, in order.
    """

    dataset: Dataset
    episodes: int
    missing: tuple[Shard, ...]

    def parameters(self, actors: int, settings: CollectSettings) -> Mapping[str, Any]:
        """What the MLflow run says of the command.

        Args:
            actors: that roll out at first.
            settings: of the collection.

        Returns:
            Plain values by name.
        """
        identity = self.dataset.identity
        return {
            "setup": identity.setup,
            "episodes": self.episodes,
            "seed": identity.seed,
            "repeats": identity.repeats,
            "gap": identity.gap,
            "bad": identity.bad_name,
            "actors": actors,
            "identity": identity.digest[:12],
            **settings.model_dump(mode="json"),
        }


def plan_collection(
    *,
    setup: Setup,
    episodes: int,
    folder: Location,
    seed: int,
    settings: CollectSettings,
    repeats: int = 1,
    gap: str = "",
    physics_of: str = EPISODE,
    chosen: Float32[np.ndarray, "c d"] | None = None,
) -> CollectionPlan:
    """The dataset in a folder, begun if need be, and the shards that are missing in it.

    Args:
        setup: whose controllers are rolled out.
        episodes: that the dataset shall hold.
        folder: of the dataset.
        seed: of all controllers and physics.
        settings: of the collection.
        repeats: episodes of each controller.
        gap: level of hidden physics that they are drawn from, or its ranges; "" for those of data collection.
        physics_of: one of `workers.draws.PHYSICS_OF`, what has physics of its own.
        chosen: controllers that come first; None where all are drawn.

    Returns:
        The plan; it is empty for a dataset that is whole.

    Raises:
        UsageError: the setup has no such gap.
        UserError: the folder holds another dataset, or cannot be written.
    """
    with usage_errors():
        under = setup.under(gap)
    identity = identity_of(
        under,
        seed=seed,
        episodes_per_shard=settings.episodes_per_shard,
        repeats=repeats,
        storage=settings.storage,
        gap=gap,
        physics_of=physics_of,
        chosen="" if chosen is None else chosen_digest(chosen),
    )
    try:
        dataset = create(folder, identity, chosen)
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error
    swept = shards.sweep(folder)
    if swept:
        say(f"removed {swept} unfinished files of processes that are gone")
    return CollectionPlan(dataset, episodes, tuple(dataset.missing(episodes)))


def say_complete(plan: CollectionPlan) -> None:
    """End a collection that has nothing to do."""
    release(plan.dataset)  # a driver that was killed at its end may have put aside what another collected
    say(f"{plan.dataset.folder} already holds {plan.dataset.episodes()} episodes: nothing to do")


def episodes_in(plan: Sequence[Shard]) -> int:
    """Episodes of all these shards."""
    return sum(shard.episodes for shard in plan)
