"""`svaedc dataset info --json`: what a dataset is, and what its episodes are like, as plain values."""

from dataclasses import asdict
from typing import Any

from cluster.datasets.quarantine import quarantined_shards
from cluster.errors import UserError
from workers.dataset.folder import Dataset
from workers.dataset.identity import Identity
from workers.dataset.notes import notes
from workers.dataset.repeats import Irreducible, irreducible
from workers.dataset.statistics import MARKS, statistics


def dataset_facts(dataset: Dataset) -> dict[str, Any]:
    """What a program reads of a dataset, by name.

    Raises:
        UserError: a shard cannot be read.
    """
    episodes = dataset.episodes()
    try:
        undecided = irreducible(dataset) if dataset.identity.repeats > 1 and episodes else None
        return {
            "folder": str(dataset.folder),
            "episodes": episodes,
            "shards": len(dataset.shards()),
            "bytes": dataset.size(),
            "fingerprint": dataset.fingerprint(),
            "put_aside": [shard.name for shard in quarantined_shards(dataset)],
            **_identity(dataset.identity),
            "statistics": _statistics(dataset) if episodes else None,
            "irreducible": _irreducible(undecided),
            "notes": [*notes(dataset), *(undecided.notes if undecided else ())],
        }
    except ValueError as error:
        raise UserError(
            f"{error}; `svaedc dataset verify {dataset.folder}` lists everything that is wrong"
        ) from error


def _identity(identity: Identity) -> dict[str, Any]:
    return {
        "identity": identity.digest,
        "setup": identity.setup,
        "seed": identity.seed,
        "repeats": identity.repeats,
        "horizon": identity.horizon,
        "control_step": identity.control_step,
        "storage": identity.storage,
        "channels": [
            {"name": name, "unit": unit, "low": low, "high": high}
            for name, unit, low, high in identity.observation
        ],
        "parameters": [{"name": name, "low": low, "high": high} for name, low, high in identity.parameters],
        "bad": {
            "conditions": list(identity.conditions),
            "kind": identity.bad_kind,
            "name": identity.bad_name,
            "digest": identity.bad_digest,
        },
        **dict(identity.versions),
    }


def _statistics(dataset: Dataset) -> dict[str, Any]:
    found = statistics(dataset)
    return {
        "objective": {
            f"{mark:g}": value for mark, value in zip(MARKS, found.objective.tolist(), strict=True)
        },
        "badness": found.badness,
        "bad_steps": dict(found.bad_steps),
        "diverged": found.diverged,
        "failed": found.failed,
        "stopped": dict(found.stopped),
    }


def _irreducible(found: Irreducible | None) -> dict[str, Any] | None:
    """What the controller does not decide; nothing of a dataset without repeats, or with too few of them."""
    return asdict(found) if found else None
