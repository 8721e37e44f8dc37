"""Fixtures of the reproduction tests."""

import pytest


@pytest.fixture(scope="session")
def few_episodes(tmp_path_factory):
    """A real dataset of eight episodes, rolled out in this process."""
    from workers import setups
    from workers.collection.shard import collect_shard
    from workers.dataset.folder import create
    from workers.dataset.identity import identity_of

    setup = setups.load("franka")
    dataset = create(
        tmp_path_factory.mktemp("few") / "dataset", identity_of(setup, seed=0, episodes_per_shard=256)
    )
    for shard in dataset.missing(8):
        collect_shard(setup, dataset, shard)
    return dataset.folder
