"""The driver of `svaedc setups compare`: roll out in both, measure, draw, say."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from cluster.agreement.clips import draw_worst
from cluster.agreement.figure import scatter
from cluster.errors import UserError
from cluster.files import json_text, replacing
from cluster.inputs import usage_errors
from cluster.progress import ProgressLine, say
from svaedc.analysis.agreement import Agreement, Fate, agreement, fate, summary_text, worst
from svaedc.analysis.strict_json import json_values
from svaedc.analysis.words import quantity
from workers.collection.twins import SAME, Twins, require_comparable, twins
from workers.episode import UNUSABLE, Episode, degrees
from workers.setups import Setup

FEWEST = 5
"""Of fewer pairs nothing is told."""
CLIPS = 3


def compare_setups(
    one: Setup, other: Setup, seed: int, count: int, gap: str, out: Path | None
) -> dict[str, Any]:
    """Compare two simulations of the same controllers, and say how far they agree.

    Args:
        one: the first.
        other: the second.
        seed: of controllers and physics.
        count: how many controllers.
        gap: physics of the second, as `workers.collection.twins.twins` takes it.
        out: folder for agreement.json, a figure and clips of the worst disagreements; None for none.

    Returns:
        What agreement.json holds.

    Raises:
        UsageError: the setups cannot run the same controllers or physics.
        UserError: too few episodes came to their end in both.
    """
    with usage_errors():
        require_comparable(one, other, gap)
    names = (one.name, f"{other.name} ({gap})" if one.name == other.name else other.name)
    with ProgressLine("controllers", count, 0) as progress:
        pairs = list(_with_progress(twins(one, other, seed, count, gap), progress))
    usable = [pair for pair in pairs if not {pair.one.stop, pair.other.stop} & UNUSABLE]
    if len(usable) < FEWEST:
        raise UserError(
            f"only {quantity(len(usable), 'controller')} of {count} came to the end in both simulations; at "
            f"least {FEWEST} must: try `svaedc check --setup {one.name}` and --setup {other.name}"
        )
    measures, best, successes = _measure(one, other, usable, names)
    left_out = {names[0]: _unusable(pairs, "one"), names[1]: _unusable(pairs, "other")}
    document = json_values(
        {
            "setups": list(names),
            "seed": seed,
            "physics": gap,
            "controllers": count,
            "usable": len(usable),
            "unusable": left_out,
            "measures": [asdict(each) for each in measures],
            "success": dict(successes),
            "best": asdict(best),
        }
    )
    say(summary_text(measures, best, names, successes))
    if gap == SAME and one.physics != other.physics:
        say(f"the ranges of their physics differ; both ran under those of {one.name} (--gap gives others)")
    if len(usable) < count:
        lost = " and ".join(f"{number} in {name}" for name, number in left_out.items())
        say(f"left out, for they diverged or failed: {lost}")
    if out is not None:
        _write(out, one, other, usable, names, document)
    return document


def _with_progress(pairs: Iterator[Twins], progress: ProgressLine) -> Iterator[Twins]:
    for pair in pairs:
        progress.advance(1, "")
        yield pair


def _unusable(pairs: Sequence[Twins], side: str) -> int:
    return sum(getattr(pair, side).stop in UNUSABLE for pair in pairs)


def _measure(
    one: Setup, other: Setup, pairs: Sequence[Twins], names: tuple[str, str]
) -> tuple[list[Agreement], Fate, Mapping[str, float]]:
    """Objective, badness, and each bad condition that both have."""
    columns = {
        "objective": [(pair.one.f, pair.other.f) for pair in pairs],
        "badness": [(pair.one.y, pair.other.y) for pair in pairs],
    }
    for condition in one.conditions if not one.task.graded and not other.task.graded else ():
        if condition in other.conditions:
            columns[condition] = [
                (_share(one, condition, pair.one), _share(other, condition, pair.other)) for pair in pairs
            ]
    sides = {name: np.array(rows, dtype=np.float64).T for name, rows in columns.items()}
    limits = (one.success, other.success)
    successes = {
        name: float((row > limit).mean())
        for name, row, limit in zip(names, sides["objective"], limits, strict=True)
    }
    measures = [agreement(name, rows[0], rows[1]) for name, rows in sides.items()]
    one_f, other_f = sides["objective"]
    return measures, fate(one_f, other_f, limits), successes


def _share(setup: Setup, condition: str, episode: Episode) -> float:
    """The share of an episode's steps in which a condition held."""
    return float(degrees(episode.bad & np.uint8(1 << setup.conditions.index(condition))).mean())


def _write(
    out: Path,
    one: Setup,
    other: Setup,
    pairs: Sequence[Twins],
    names: tuple[str, str],
    document: Mapping[str, Any],
) -> None:
    out.mkdir(parents=True, exist_ok=True)
    with replacing(out / "agreement.json") as unfinished:
        unfinished.write_text(json_text(document), encoding="utf-8")
    f, y = (
        np.array([(getattr(pair.one, kind), getattr(pair.other, kind)) for pair in pairs]).T
        for kind in ("f", "y")
    )
    scatter(out / "agreement.png", names, f, y, document)
    written = draw_worst(out, (one, other), names, [pairs[place] for place in worst(f[0], f[1], CLIPS)])
    clips = f", {', '.join(written)}" if written else ""
    say(f"wrote {out}: agreement.json, agreement.png{clips}")
