"""`svaedc candidates`: simulate what is missing, encode it, and write the table."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from cluster.candidates.plan import CandidatesPlan, stride_of
from cluster.config import CollectSettings
from cluster.datasets.collect import collect
from cluster.files import writing
from cluster.optimization.candidates import CandidateTable, read, write
from cluster.optimization.models import TrainedModel
from cluster.progress import say
from cluster.runtime.session import Session
from cluster.tracking import Tracker
from svaedc.analysis.words import quantity
from svaedc.bo.simulated.encoding import latent_paths
from workers.dataset.folder import Dataset
from workers.dataset.schema import Columns
from workers.dataset.statistics import bad_steps
from workers.episode import degrees, stride_steps


def simulate(
    plan: CandidatesPlan, settings: CollectSettings, session: Session, tracker: Tracker
) -> CandidateTable:
    """Roll out what is missing of the candidates' episodes, and write their table.

    Args:
        plan: which candidates.
        settings: of the collection.
        session: where the actors run.
        tracker: that records it.

    Returns:
        The table.

    Raises:
        UserError: as `collect` does.
    """
    for collection in plan.collections:
        if collection.missing:
            collect(collection, settings, session, tracker)
    return summarise(plan)


def summarise(plan: CandidatesPlan) -> CandidateTable:
    """Write the table of candidates whose episodes are all there, and say what it holds.

    Args:
        plan: which candidates.

    Returns:
        The table.

    Raises:
        UserError: an episode cannot be read, or the disk takes no more.
    """
    parts = [_outcomes(plan, collection.dataset) for collection in plan.collections]
    table = CandidateTable(
        x=parts[0]["x"],
        **{name: _all_worlds(parts, name) for name in ("f", "y", "bad")},
        tau={model: _all_worlds(parts, model) for model in plan.origin["models"]},
        origin=plan.full_origin(),
    )
    with writing(plan.folder):
        write(plan.table, table)
    say_table(plan, table)
    return table


def _all_worlds(parts: Sequence[Mapping[str, np.ndarray]], name: str) -> np.ndarray:
    return np.concatenate([part[name] for part in parts], axis=1)


def say_whole(plan: CandidatesPlan) -> None:
    """End a command that has nothing to do."""
    say_table(plan, read(plan.table))


def say_table(plan: CandidatesPlan, table: CandidateTable) -> None:
    """Say what a table holds, in one line.

    Args:
        plan: which candidates.
        table: of them.
    """
    worlds, f = table.f.shape[1], table.f.mean(axis=1)
    place = int(f.argmax())
    say(
        f"{plan.table} holds {quantity(len(f), 'candidate')} in {quantity(worlds, 'world')} of "
        f"{', '.join(setup.name for setup in plan.setups)}; the best has a mean objective of {f[place]:.3g} "
        f"(spread {table.f[place].std():.2g}), the median {np.median(f):.3g}; "
        f"mean badness {table.y.mean():.2f}"
    )


def _outcomes(plan: CandidatesPlan, dataset: Dataset) -> dict[str, np.ndarray]:
    """What the episodes of one setup showed, [candidate, world, ...]; latent paths by their models."""
    parts = list(_parts(plan, dataset))
    whole = {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}
    count = len(whole["f"]) // plan.episodes
    folded = {name: values.reshape(count, plan.episodes, *values.shape[1:]) for name, values in whole.items()}
    return {**folded, "x": folded["x"][:, 0]}


def _parts(plan: CandidatesPlan, dataset: Dataset) -> Iterator[dict[str, np.ndarray]]:
    episodes = plan.origin["count"] * plan.episodes
    for shard in dataset.disjoint():
        columns = dataset.read(shard)
        kept = slice(0, max(0, episodes - shard.start))  # a dataset may hold more than is asked for
        conditions = bad_steps(columns.bad, len(dataset.identity.conditions)) / dataset.identity.horizon
        yield {
            "x": columns.x[kept],
            "f": columns.f[kept].astype(np.float64),
            "y": columns.y[kept].astype(np.float64),
            "bad": conditions[kept].astype(np.float64),
            **{
                name: _latents(model, columns, dataset.identity.horizon)[kept]
                for name, model in zip(plan.origin["models"], plan.models, strict=True)
            },
        }


def _latents(model: TrainedModel, columns: Columns, horizon: int) -> np.ndarray:
    steps = stride_steps(horizon, stride_of(model))
    bad = degrees(columns.bad[:, steps]).astype(np.float32)
    return latent_paths(model.model, columns.xi[:, :, steps], bad, columns.y)
