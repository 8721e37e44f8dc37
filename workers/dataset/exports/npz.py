"""A dataset as plain NumPy archives, one for each shard, for tools that do not read Parquet."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from workers.dataset.folder import Dataset
from workers.dataset.identity import Identity
from workers.dataset.manifest import MANIFEST, manifest_text
from workers.dataset.schema import Columns
from workers.dataset.shards import Shard


def export_npz(dataset: Dataset, out: Path) -> Iterator[Shard]:
    """Write `episodes-START-STOP.npz` for every shard and the identity as `dataset.json`.

    One shard is in memory at a time. The archives hold no Python objects: `numpy.load` opens them as is.

    Args:
        dataset: what is exported.
        out: an existing folder.

    Yields:
        Each shard once it is written.

    Raises:
        ValueError: a shard is damaged, or two overlap.
    """
    shards = dataset.disjoint()
    (out / MANIFEST).write_text(manifest_text(dataset.identity), encoding="utf-8")
    names = _names(dataset.identity)
    for shard in shards:
        arrays = _arrays(dataset.read(shard), dataset.identity)
        np.savez(out / f"{Path(shard.name).stem}.npz", allow_pickle=False, **arrays, **names)
        yield shard


def _arrays(columns: Columns, identity: Identity) -> dict[str, np.ndarray]:
    physics = [columns.physics[name] for name in sorted(identity.physics)]
    return {
        "episode": columns.episode,
        "x": columns.x,
        "xi": columns.xi,
        "bad": columns.bad,
        "y": columns.y,
        "f": columns.f,
        "stop": np.array(columns.stop),
        "physics": np.stack(physics, axis=1) if physics else np.empty((len(columns.episode), 0)),
    }


def _names(identity: Identity) -> dict[str, np.ndarray]:
    """What the axes mean, the same in every archive."""
    return {
        "parameter_names": np.array([name for name, *_ in identity.parameters]),
        "observation_names": np.array([name for name, *_ in identity.observation]),
        "observation_units": np.array([unit for _, unit, *_ in identity.observation]),
        "condition_names": np.array(identity.conditions),
        "physics_names": np.array(sorted(identity.physics)),
        "control_step": np.array(identity.control_step),
    }
