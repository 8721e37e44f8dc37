"""The plan of a collection, kept beside its dataset until its end: what was expected, and what it took.

`plan.json` is no part of the dataset: neither its identity nor its fingerprint knows it.
"""

import json
import math
from collections.abc import Mapping
from typing import Any

from cluster.datasets.progress import CollectionProgress
from cluster.files import json_text
from cluster.progress import duration, say
from workers.collection.forecast import LEVEL, Forecast, Prediction
from workers.dataset.folder import Dataset
from workers.dataset.storage.atomic import move, synchronise, temporary_file
from workers.dataset.storage.location import Location

PLAN = "plan.json"


def begin(dataset: Dataset, episodes: int, expected: Forecast, pilot: CollectionProgress) -> None:
    """Keep what is expected of a job, in the place of an earlier plan; its pilot is spent already.

    Args:
        dataset: beside which the plan is kept.
        episodes: that the dataset holds at the end of the job.
        expected: of the job.
        pilot: what has been done of it.
    """
    account = [_entry(pilot, pilot.seconds * expected.actors)]
    _write(dataset, {"episodes": episodes, "expected": expected.to_json(), "spent": account})


def add_cost(dataset: Dataset, counts: CollectionProgress, actor_seconds: float) -> None:
    """Add what a command has done to the account of the plan, if there is one.

    Args:
        dataset: beside which the plan is kept.
        counts: what has been done.
        actor_seconds: for how long there were actors, summed over them.
    """
    plan = _read(dataset)
    if plan and "off" not in plan and counts.episodes:
        _write(dataset, {**plan, "spent": [*plan["spent"], _entry(counts, actor_seconds)]})


def review(dataset: Dataset) -> dict[str, float]:
    """Say how far off the plan was, once, when its episodes are there; the same as numbers for MLflow.

    Work that was killed has left no account, so what was expected of the episodes accounted for is compared.
    """
    plan = _read(dataset)
    if not plan or "off" in plan or dataset.episodes() < plan["episodes"]:
        return {}
    expected = Forecast.from_json(plan["expected"])
    done = sum(entry["episodes"] for entry in plan["spent"])
    share = done / expected.episodes
    rows = {
        "core_hours": (expected.core_hours.value * share, _sum(plan, "core_seconds") / 3600),
        "hours": (expected.hours.value * share, _sum(plan, "actor_seconds") / 3600 / expected.actors),
        "bytes": (expected.size.value * share, _sum(plan, "size")),
        "badness": (expected.badness.value, _sum(plan, "bad") / max(done, 1)),
    }
    off = {name: took / wanted - 1 for name, (wanted, took) in rows.items() if wanted}
    say(
        f"against the plan, {done} of {expected.episodes} episodes accounted for: "
        + ", ".join(f"{name} {100 * value:+.1f} %" for name, value in off.items())
    )
    _write(dataset, {**plan, "off": off})
    return {f"plan/{name}_off": value for name, value in off.items()}


def metrics(expected: Forecast) -> dict[str, float]:
    """The plan as numbers for MLflow."""
    return {
        "plan/core_hours": expected.core_hours.value,
        "plan/hours": expected.hours.value,
        "plan/bytes": expected.size.value,
        "plan/badness": expected.badness.value,
    }


def plan_text(expected: Forecast, done: int) -> str:
    """Put the plan into words, each number with the half width of its interval.

    Args:
        expected: of the whole job.
        done: episodes that the plan is made from.

    Returns:
        Text of several lines.
    """
    core, wall, size, bad = expected.core_hours, expected.hours, expected.size, expected.badness
    lines = (
        f"the whole job of {expected.episodes} episodes on {expected.actors} actors, from its first {done}:",
        f"  core-hours  {_text(core, 1.0)}",
        f"  wall time   {duration(3600 * wall.value)} ± {duration(3600 * wall.margin)}",
        f"  disk        {_text(size, 1e-6)} MB",
        f"  badness     {bad.value:.3f} ± {bad.margin:.3f} on average",
        f"  (± holds the true number in {100 * LEVEL:.0f} % of cases, if nothing else changes; the shards "
        "of the pilot are kept, and the same command without --plan goes on from them)",
    )
    return "\n".join(lines)


def _text(estimate: Prediction, factor: float) -> str:
    """As many digits as the margin's first two."""
    value, margin = estimate.value * factor, estimate.margin * factor
    places = max(0, 1 - math.floor(math.log10(margin))) if margin else 2
    return f"{value:.{places}f} ± {margin:.{places}f}"


def _entry(counts: CollectionProgress, actor_seconds: float) -> dict[str, int | float]:
    return {
        "episodes": counts.episodes,
        "actor_seconds": actor_seconds,
        "core_seconds": counts.core_seconds,
        "size": counts.size,
        "bad": counts.bad,
    }


def _sum(plan: Mapping[str, Any], name: str) -> float:
    return float(sum(entry[name] for entry in plan["spent"]))


def _path(dataset: Dataset) -> Location:
    return dataset.folder / PLAN


def _read(dataset: Dataset) -> dict[str, Any]:
    """The plan; nothing when there is none, or one that nobody can read, for it decides nothing."""
    try:
        plan = json.loads(_path(dataset).read_text(encoding="utf-8"))
        Forecast.from_json(plan["expected"])
        is_whole = isinstance(plan["episodes"], int) and all(len(entry) == 5 for entry in plan["spent"])
        return plan if is_whole else {}
    except (OSError, ValueError, KeyError, TypeError):
        return {}


def _write(dataset: Dataset, plan: Mapping[str, Any]) -> None:
    """At once, under a name of this process, for a second driver may do the same; a failure costs no data."""
    try:
        with temporary_file(dataset.folder, PLAN) as temporary:
            temporary.write_text(json_text(plan) + "\n", encoding="utf-8")
            synchronise(temporary)
            move(temporary, _path(dataset))
    except OSError as error:
        say(f"the account of the plan cannot be kept in {_path(dataset)}: {error.strerror}")
