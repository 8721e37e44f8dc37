"""What a collection will cost, from its first shards: expected numbers and their prediction intervals."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from itertools import islice

import numpy as np
from scipy.special import stdtrit

from workers.collection.shard import ShardReport
from workers.dataset.shards import Shard

LEVEL = 0.9
"""This share of the intervals is to hold the true number, if shards are alike."""


PILOT_SHARDS = 4
"""A plan rolls out that many shards, or two on every actor if that is more."""
PILOT_SHARE = 0.1
"""A plan rolls out no more than this share of what it is made for."""


def pilot_of(missing: Sequence[Shard], actors: int) -> list[Shard]:
    """Choose the shards that a plan is made from: whole ones, or the beginnings of some in a small job.

    Args:
        missing: shards of the job, in order.
        actors: that roll out at the same time.

    Returns:
        At least two shards, which hold a tenth of the episodes at most; none where that is not possible.
    """
    wanted = max(PILOT_SHARDS, 2 * actors)
    most = int(PILOT_SHARE * sum(shard.episodes for shard in missing))
    if sum(shard.episodes for shard in missing[:wanted]) <= most:
        return list(missing[:wanted])
    parts = min(wanted, most)
    if parts < 2:
        return []
    size = most // parts
    pieces = (
        Shard(start, min(start + size, shard.stop))
        for shard in missing
        for start in range(shard.start, shard.stop, size)
    )
    return list(islice(pieces, parts))


@dataclass(frozen=True)
class Prediction:
    """An expected number; the true one lies within `margin` of it with probability `LEVEL`."""

    value: float
    margin: float


@dataclass(frozen=True)
class Forecast:
    """What a job costs as a whole, its pilot included.

    Attributes:
        episodes: of the job.
        actors: that roll them out at the same time.
        core_hours: CPU time of rollouts and storage, h.
        hours: from the first rollout to the last, h.
        size: bytes on disk.
        badness: mean y.
    """

    episodes: int
    actors: int
    core_hours: Prediction
    hours: Prediction
    size: Prediction
    badness: Prediction

    def __post_init__(self) -> None:
        """Refuse jobs of nobody or nothing."""
        if self.episodes < 1 or self.actors < 1:
            raise ValueError(f"a job needs episodes and actors, got {self.episodes} and {self.actors}")

    def to_json(self) -> dict[str, object]:
        """As plain values."""
        return asdict(self)

    @classmethod
    def from_json(cls, values: Mapping[str, object]) -> "Forecast":
        """The forecast that `to_json` turned into plain values.

        Raises:
            ValueError: they are not those of a forecast.
        """
        try:
            plain = {
                name: Prediction(**value) if isinstance(value, Mapping) else value
                for name, value in values.items()
            }
            return cls(**plain)  # type: ignore[arg-type]
        except TypeError as error:
            raise ValueError(f"no forecast: {error}") from error


def forecast(pilot: Sequence[ShardReport], episodes: int, actors: int) -> Forecast:
    """Estimate what a job costs, of which some shards are done.

    The other shards cost the mean of those, in proportion to their episodes; the interval is Student's for
    the mean of m further shards, given n: t · s · √(1/n + 1/m).

    Args:
        pilot: the shards that are done, at least two.
        episodes: of the whole job, with those of the pilot.
        actors: that roll out at the same time.

    Returns:
        Expected numbers of the whole job, each with its margin; the margins are 0 when nothing is left to do.

    Raises:
        ValueError: the pilot is too short to know a spread, or longer than the job.
    """
    done = sum(report.shard.episodes for report in pilot)
    if len(pilot) < 2 or episodes < done:
        raise ValueError(
            f"a forecast needs at least 2 shards of the job, got {len(pilot)} with {done} of its "
            f"{episodes} episodes"
        )

    def total(costs: Sequence[float]) -> Prediction:
        return _total(costs, [report.shard.episodes for report in pilot], episodes)

    seconds = total([report.seconds for report in pilot])
    core_seconds = total([report.rollout_seconds + report.storage_seconds for report in pilot])
    bad = total([report.badness * report.shard.episodes for report in pilot])
    return Forecast(
        episodes=episodes,
        actors=actors,
        core_hours=_scale(core_seconds, 1 / 3600),
        hours=_scale(seconds, 1 / 3600 / actors),
        size=total([float(report.size) for report in pilot]),
        badness=_scale(bad, 1 / episodes),
    )


def _total(costs: Sequence[float], sizes: Sequence[int], episodes: int) -> Prediction:
    """The cost of all episodes, from that of shards with these sizes; what is done is certain."""
    spent, done = math.fsum(costs), sum(sizes)
    left = episodes - done
    if not left:
        return Prediction(spent, 0.0)
    count, others = len(costs), left / (done / len(costs))
    each = np.array(costs) / np.array(sizes)
    spread = float(each.std(ddof=1))
    t = float(stdtrit(count - 1, (1 + LEVEL) / 2))
    return Prediction(spent * episodes / done, left * t * spread * math.sqrt(1 / count + 1 / others))


def _scale(estimate: Prediction, factor: float) -> Prediction:
    return Prediction(estimate.value * factor, estimate.margin * factor)
