"""`svaedc dataset info`: what a dataset is, and what its episodes are like, as lines to read."""

from cluster.datasets.quarantine import quarantined_shards
from cluster.errors import UserError
from svaedc.analysis.words import quantity
from workers.dataset.folder import Dataset
from workers.dataset.identity import Identity
from workers.dataset.notes import notes
from workers.dataset.repeats import Irreducible, irreducible
from workers.dataset.statistics import Statistics, statistics


def dataset_info(dataset: Dataset) -> dict[str, str]:
    """What a person reads of a dataset, by name.

    Raises:
        UserError: a shard cannot be read.
    """
    identity = dataset.identity
    episodes, kilobytes = dataset.episodes(), dataset.size() / 1e3
    rows = {
        "setup": identity.setup,
        "episodes": f"{episodes} in {quantity(len(dataset.shards()), 'shard')}",
        "size": f"{kilobytes / 1e3:.1f} MB, {kilobytes / max(episodes, 1):.1f} kB an episode",
        "each": f"{quantity(identity.horizon, 'step')} of {identity.control_step * 1e3:g} ms",
        "observation": f"{quantity(len(identity.observation), 'channel')}, stored as {identity.storage}",
        "controller": quantity(len(identity.parameters), "parameter"),
        "seed": str(identity.seed),
        "G_bad": _g_bad(identity),
        "repeats": f"{identity.repeats} of each controller",
        "identity": identity.digest,
        "fingerprint": dataset.fingerprint(),
        "made with": ", ".join(" ".join(package) for package in identity.versions),
        "put aside": ", ".join(shard.name for shard in quarantined_shards(dataset)) or "none",
    }
    try:
        rows |= _table_rows(statistics(dataset)) if episodes else {}
        undecided = irreducible(dataset) if identity.repeats > 1 else None
        rows |= _irreducible(undecided) if identity.repeats > 1 else {}
        told = (*notes(dataset), *(undecided.notes if undecided else ()))
        rows |= {f"note {number}": note for number, note in enumerate(told, start=1)}
    except ValueError as error:
        raise UserError(
            f"{error}; `svaedc dataset verify {dataset.folder}` lists everything that is wrong"
        ) from error
    return rows


def _table_rows(found: Statistics) -> dict[str, str]:
    return {
        "objective": "  ".join(f"{value:+.2f}" for value in found.objective)
        + "  (min, 5, 25, 50, 75, 95 %, max)",
        "badness": f"{found.badness:.3f} on average",
        "bad steps": ", ".join(f"{name} {share:.3f}" for name, share in found.bad_steps.items()),
        "diverged": str(found.diverged),
        "failed": str(found.failed),
        "stopped": ", ".join(f"{count} {reason}" for reason, count in found.stopped.items()) or "0",
    }


def _g_bad(identity: Identity) -> str:
    name = f"{identity.bad_name} ({identity.bad_digest[:12]})" if identity.bad_name else "the setup's own"
    return f"{name}, {identity.bad_kind}"


def _irreducible(found: Irreducible | None) -> dict[str, str]:
    """What the controller does not decide."""
    if found is None:
        return {"irreducible": "unknown: fewer than two controllers have all their repeats"}
    low, high = found.xi
    return {
        "irreducible": f"{found.y:.2f} of the variance of y, {found.f:.2f} of that of f "
        f"({found.controllers} controllers); of xi, {low:.2f} to {high:.2f} of the error of its median"
    }
