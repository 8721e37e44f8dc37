"""Small collections of the Franka: by a cluster, and by this process alone."""

from pathlib import Path

from cluster.config import CollectSettings
from cluster.datasets.collect import collect
from cluster.datasets.plan import plan_collection
from cluster.tracking import open_tracker
from workers import setups
from workers.collection.shard import collect_shard
from workers.dataset.folder import create
from workers.dataset.identity import identity_of

SETTINGS = CollectSettings(actors=2, episodes_per_shard=8)


def collected(folder: Path, episodes: int, session, tracking_settings, seed: int = 3):
    return collect(
        plan_collection(
            setup=setups.load("franka"), episodes=episodes, folder=folder, seed=seed, settings=SETTINGS
        ),
        SETTINGS,
        session,
        open_tracker(tracking_settings),
    )


def alone(folder: Path, episodes: int, seed: int = 3):
    """The same dataset, made in this process."""
    setup = setups.load("franka")
    dataset = create(folder, identity_of(setup, seed=seed, episodes_per_shard=8))
    for shard in dataset.missing(episodes):
        collect_shard(setup, dataset, shard)
    return dataset
