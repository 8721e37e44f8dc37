"""A dataset whose episodes cost nothing: random numbers in the shape of a rollout's record."""

import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest


@pytest.fixture
def identity():
    """A small identity with the physics names out of order, as a setup may declare them."""
    from workers.dataset.identity import Identity

    return Identity(
        setup="toy",
        parameters=(("stiffness", 0.0, 1.0), ("damping", 0.0, 2.0)),
        observation=(("joint", "rad", -1.0, 1.0), ("object_x", "m", -3.0, 3.0), ("object_y", "m", -3.0, 3.0)),
        conditions=("tipped", "off_table"),
        horizon=20,
        control_step=0.002,
        physics={"mass": (1.9, 2.1), "friction": (0.2, 0.4)},
        seed=5,
        episodes_per_shard=8,
        schema_version=1,
        rollout_version=1,
        pybullet="3",
        numpy="2",
    )


@pytest.fixture
def episodes_of():
    """(identity, indices) -> the episodes with those indices, each a function of (seed, index) alone."""
    from workers.episode import Episode
    from workers.physics import PhysicsRanges
    from workers.randomness import Stream, generator

    def episode(identity, index: int) -> Episode:
        rng = np.random.default_rng([identity.seed, zlib.crc32(b"toy"), index])
        diverged = index % 7 == 3
        bad = np.where(diverged, 3, rng.integers(0, 4, identity.horizon)).astype(np.uint8)
        return Episode(
            x=generator(identity.seed, Stream.CONTROLLER, index // identity.repeats).random(
                2, dtype=np.float32
            ),
            xi=rng.uniform(-1, 1, (3, identity.horizon)).astype(np.float32),
            bad=bad,
            y=float((bad != 0).mean()),
            f=float(np.float32(rng.normal())),
            stop="diverged" if diverged else "",
            physics=PhysicsRanges(identity.physics).draw(generator(identity.seed, Stream.PHYSICS, index)),
        )

    return lambda identity, indices: [episode(identity, index) for index in indices]


@pytest.fixture
def fill(episodes_of):
    """(dataset, episodes) -> commits the shards that are missing."""
    from workers.dataset import schema, shards

    def commit_missing(dataset, episodes: int) -> None:
        for shard in dataset.missing(episodes):
            rows = episodes_of(dataset.identity, range(shard.start, shard.stop))
            shards.commit(
                dataset.folder,
                shard,
                lambda path, rows=rows, start=shard.start: schema.write(path, dataset.identity, start, rows),
            )

    return commit_missing


@pytest.fixture
def stopped_of(episodes_of):
    """(identity, indices) -> the same, but every fifth episode stops at its twelfth step as "too far"."""

    def stopped(episode):
        bad, xi = episode.bad.copy(), episode.xi.copy()
        bad[11:] = 4
        xi[:, 11:] = xi[:, 11:12]
        return replace(episode, xi=xi, bad=bad, y=float((bad != 0).mean()), f=-2.0, stop="too far")

    def episodes(identity, indices):
        plain = zip(indices, episodes_of(identity, indices), strict=True)
        return [stopped(each) if index % 5 == 1 else each for index, each in plain]

    return episodes


@pytest.fixture
def guarded(tmp_path: Path, identity, stopped_of):
    """Two shards of 8 episodes of a setup with a stop rule: 1, 6 and 11 stopped, 3 and 10 diverged."""
    from workers.dataset import schema, shards
    from workers.dataset.folder import create

    created = create(tmp_path / "guarded", replace(identity, conditions=(*identity.conditions, "stopped")))
    for shard in created.missing(16):
        rows = stopped_of(created.identity, range(shard.start, shard.stop))
        rows = [replace(row, bad=row.bad | 4) if row.stop == "diverged" else row for row in rows]
        shards.commit(
            created.folder,
            shard,
            lambda path, rows=rows, start=shard.start: schema.write(path, created.identity, start, rows),
        )
    return created


@pytest.fixture
def dataset(tmp_path: Path, identity, fill):
    """Three shards of 8, 8 and 4 episodes."""
    from workers.dataset.folder import create

    created = create(tmp_path / "dataset", identity)
    fill(created, 20)
    return created
