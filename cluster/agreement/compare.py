"""The driver of `svaedc setups compare`: roll out in both, measure, draw, say."""

from collections.abc import Iterator
from dataclasses import asdict
from pathlib import Path
from typing import Any

from cluster.agreement.clips import draw_worst
from cluster.agreement.figure import scatter
from cluster.errors import UserError
from cluster.files import json_text, replacing
from cluster.inputs import usage_errors
from cluster.progress import ProgressLine, say
from svaedc.analysis.agreement import Agreement, Simulated, agreement, summary_text, worst_places
from svaedc.analysis.strict_json import json_values
from svaedc.analysis.words import quantity
from workers.collection.twins import SAME, Twins, outcomes, require_comparable, twins
from workers.episode import UNUSABLE
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
    with ProgressLine("controllers", count, 0) as progress:
        pairs = list(_with_progress(twins(one, other, seed, count, gap), progress))
    usable = [pair for pair in pairs if not {pair.one.stop, pair.other.stop} & UNUSABLE]
    if len(usable) < FEWEST:
        raise UserError(
            f"only {quantity(len(usable), 'controller')} of {count} came to the end in both simulations; at "
            f"least {FEWEST} must: try `svaedc check --setup {one.name}` and --setup {other.name}"
        )
    there = f"{other.name} ({gap})" if one.name == other.name else other.name
    sides = (
        Simulated(one.name, one.success, **outcomes(one, [pair.one for pair in usable])),
        Simulated(there, other.success, **outcomes(other, [pair.other for pair in usable])),
    )
    found = agreement(*sides)
    lost = (_count_lost(pairs, "one"), _count_lost(pairs, "other"))
    _say(found, lost)
    if gap == SAME and one.physics != other.physics:
        say(f"the ranges of their physics differ; both ran under those of {one.name} (--gap gives others)")
    asked = {"seed": seed, "physics": gap, "controllers": count}
    document = json_values(asked | _facts(found, usable, lost))
    if out is not None:
        out.mkdir(parents=True, exist_ok=True)
        with replacing(out / "agreement.json") as unfinished:
            unfinished.write_text(json_text(document), encoding="utf-8")
        scatter(out / "agreement.png", *sides, found)
        worst = [usable[place] for place in worst_places(sides[0].f, sides[1].f, CLIPS)]
        clips = draw_worst(out, (one, other), found.names, worst)
        say(f"wrote {out}: {', '.join(['agreement.json', 'agreement.png', *clips])}")
    return document


def _with_progress(pairs: Iterator[Twins], progress: ProgressLine) -> Iterator[Twins]:
    for pair in pairs:
        progress.advance(1, "")
        yield pair


def _count_lost(pairs: list[Twins], side: str) -> int:
    """How many episodes of a side diverged or failed."""
    return sum(getattr(pair, side).stop in UNUSABLE for pair in pairs)


def _say(found: Agreement, lost: tuple[int, int]) -> None:
    say(summary_text(found))
    if any(lost):
        told = " and ".join(f"{number} in {name}" for name, number in zip(found.names, lost, strict=True))
        say(f"left out, for they diverged or failed: {told}")


def _facts(found: Agreement, usable: list[Twins], lost: tuple[int, int]) -> dict[str, Any]:
    return {
        "setups": list(found.names),
        "usable": len(usable),
        "unusable": dict(zip(found.names, lost, strict=True)),
        "measures": [asdict(each) for each in found.measures],
        "success": dict(zip(found.names, found.success, strict=True)),
        "best": asdict(found.best),
    }
