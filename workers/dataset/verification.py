"""Proof that a dataset is whole: every byte, every index, every number that follows from others."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain

import numpy as np

from workers.dataset import shards
from workers.dataset.folder import Dataset
from workers.dataset.identity import Identity
from workers.dataset.schema import Columns, read, read_identity
from workers.dataset.shards import Shard
from workers.dataset.storage.location import Location, fetch
from workers.draws import Draws
from workers.episode import UNUSABLE, degrees
from workers.physics import PhysicsRanges
from workers.tasks.stop import STOPPED


@dataclass(frozen=True)
class Defect:
    """Something wrong with one file."""

    file: str
    what: str


def verify(dataset: Dataset) -> Iterator[tuple[Shard, list[Defect]]]:
    """Check every shard in turn, and yield it with what is wrong with it; nothing is changed or deleted.

    Episodes between shards that nobody has collected yet are no fault of a file: see `gaps`.
    """
    doubled = overlaps(dataset)
    for shard in dataset.shards():
        beside = [problem for problem in doubled if problem.file == shard.name]
        yield shard, beside + file_problems(dataset, shard)


def overlaps(dataset: Dataset) -> list[Defect]:
    """The shards that hold episodes once more; each may be whole in itself."""
    found, reached = [], 0
    for shard in dataset.shards():
        if shard.start < reached:
            what = f"it overlaps: episodes below {reached} are in files before it"
            found.append(Defect(shard.name, what))
        reached = max(reached, shard.stop)
    return found


def file_problems(dataset: Dataset, shard: Shard) -> list[Defect]:
    """Find what is wrong with a shard in itself, whatever lies beside it.

    Args:
        dataset: to which it belongs.
        shard: what is checked.

    Returns:
        One defect per problem; none if it is whole.
    """
    path = fetch(dataset.path(shard))
    found = chain(_byte_problems(dataset, shard, path), _row_problems(dataset, shard, path))
    return [Defect(shard.name, what) for what in found]


def gaps(dataset: Dataset) -> Iterator[Shard]:
    """The episodes before the last that are in no shard, as an interrupted collection leaves them."""
    reached = 0
    for shard in dataset.shards():
        if shard.start > reached:
            yield Shard(reached, shard.start)
        reached = max(reached, shard.stop)


def _byte_problems(dataset: Dataset, shard: Shard, path: Location) -> Iterator[str]:
    digest_path = shards.digest_path(dataset.folder, shard)
    recorded = shards.recorded_digest(dataset.folder, shard)
    if not recorded:
        yield "its .sha256 file is missing"
        return
    held = shards.readable_sha256(path)
    if held == shards.UNREADABLE:
        yield "the disk does not read it"
    elif held != recorded:
        yield "its bytes differ from its .sha256 file"
    elif digest_path.read_text(encoding="utf-8", errors="replace") != shards.digest_line(shard, recorded):
        yield "its .sha256 file is not as `sha256sum` writes it"


def _row_problems(dataset: Dataset, shard: Shard, path: Location) -> Iterator[str]:
    try:
        differences = dataset.identity.differences(read_identity(path))
        if differences:
            yield f"it belongs to another dataset: {'; '.join(differences)}"
            return
        columns = read(path, dataset.identity)
    except ValueError as error:
        yield str(error)
        return
    if np.array_equal(columns.episode, np.arange(shard.start, shard.stop)):
        yield from _content_problems(columns, dataset.identity, dataset.draws())
    else:
        yield f"its rows are not the episodes {shard.start} to {shard.stop - 1}"


def _stop_problems(columns: Columns, identity: Identity) -> Iterator[str]:
    """Diverged and failed episodes are bad throughout, stopped ones from the reason on, others never."""
    reasons = np.array(columns.stop)
    useless = np.isin(reasons, list(UNUSABLE))
    if not np.all(columns.bad[useless]):
        yield "a diverged or failed episode has steps that are not bad"
    if identity.bad_kind == "graded":
        if np.any(columns.bad[~useless & (reasons != ""), -1] != 1.0):
            yield "a stopped episode ends with a step that is not bad"
        return
    bit = 1 << identity.conditions.index(STOPPED) if STOPPED in identity.conditions else 0
    stopped = (columns.bad[~useless] & bit) != 0
    if not np.array_equal(stopped[:, -1], reasons[~useless] != ""):
        yield f"its stop reasons do not fit the condition {STOPPED!r} of the last steps"
    if np.any(stopped[:, :-1] > stopped[:, 1:]):
        yield "an episode goes on after it was stopped"


def _content_problems(columns: Columns, identity: Identity, draws: Draws) -> Iterator[str]:
    if not all(np.isfinite(values).all() for values in (columns.x, columns.xi, columns.y, columns.f)):
        yield "it holds numbers that are not finite"
    if not np.all((degrees(columns.bad) >= 0.0) & (degrees(columns.bad) <= 1.0)):
        yield "it holds degrees of badness outside [0, 1]"
    if not np.allclose(columns.y, degrees(columns.bad).mean(axis=1, dtype=np.float64), atol=1e-6):
        yield "y is not the mean of the bad steps"
    yield from _stop_problems(columns, identity)
    indices, width = columns.episode.tolist(), columns.x.shape[1]
    if not all(
        np.array_equal(x, draws.controller(width, index)) for x, index in zip(columns.x, indices, strict=True)
    ):
        yield f"its controllers are not those of seed {identity.seed}"
    ranges = PhysicsRanges(identity.physics)
    if not all(
        draws.physics(ranges, index) == {name: values[row] for name, values in columns.physics.items()}
        for row, index in enumerate(indices)
    ):
        yield f"its physics are not those of seed {identity.seed}"
