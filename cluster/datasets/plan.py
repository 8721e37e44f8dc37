"""What a collection will do, decided before Ray or MLflow is loaded: a whole dataset costs neither."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from cluster.config import CollectSettings
from cluster.datasets.quarantine import release
from cluster.errors import UserError
from cluster.progress import say
from workers.dataset import shards
from workers.dataset.folder import Dataset, create
from workers.dataset.identity import identity_of
from workers.dataset.shards import Shard
from workers.dataset.storage.location import Location
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
            "bad": identity.bad_name,
            "actors": actors,
            "identity": identity.digest[:12],
            **settings.model_dump(mode="json"),
        }


def plan_collection(
    *, setup: Setup, episodes: int, folder: Location, seed: int, repeats: int = 1, settings: CollectSettings
) -> CollectionPlan:
    """The dataset in a folder, begun if need be, and the shards that are missing in it.

    Args:
        setup: whose controllers are rolled out.
        episodes: that the dataset shall hold.
        folder: of the dataset.
        seed: of all controllers and physics.
        repeats: episodes of each controller.
        settings: of the collection.

    Returns:
        The plan; it is empty for a dataset that is whole.

    Raises:
        UserError: the folder holds another dataset, or cannot be written.
    """
    identity = identity_of(
        setup,
        seed=seed,
        episodes_per_shard=settings.episodes_per_shard,
        repeats=repeats,
        storage=settings.storage,
    )
    try:
        dataset = create(folder, identity)
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
