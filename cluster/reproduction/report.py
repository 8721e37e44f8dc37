"""The claims of the paper beside what was measured: a table to read, and the same as JSON."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from cluster.comparison.folder import FIGURE, PAGE
from cluster.files import write_json, write_text, writing
from cluster.reproduction.plan import Reproduction
from cluster.reproduction.recipe import Recipe
from svaedc.analysis.evidence import Claim, Finding
from svaedc.analysis.strict_json import json_values
from svaedc.analysis.summary import Summary

_HEADER = ("the paper", "where", "measured here", "value, 90 % interval", "runs", "verdict")


@dataclass(frozen=True)
class Entry:
    """One number beside the claim it belongs to."""

    claim: Claim
    measure: str
    finding: Finding

    @property
    def value(self) -> str:
        """The number as text."""
        value = self.finding.value
        if math.isnan(value.mean):
            return "–"
        interval = "" if math.isnan(value.low) else f" [{value.low:+.3f}, {value.high:+.3f}]"
        return f"{value.mean:+.3f}{interval}"


@dataclass(frozen=True)
class Table:
    """All numbers of a figure."""

    recipe: Recipe
    entries: tuple[Entry, ...]

    def rows(self) -> Iterator[tuple[str, ...]]:
        """Cells; a claim stands beside its first number only."""
        shown = None
        for entry in self.entries:
            claim = ("", "") if entry.claim is shown else (entry.claim.text, entry.claim.source)
            shown = entry.claim
            yield (*claim, entry.measure, entry.value, str(entry.finding.runs), entry.finding.verdict)

    def lines(self) -> Iterator[str]:
        """For a terminal."""
        yield f"{self.recipe.figure}: {self.recipe.label}"
        for text, source, measure, value, runs, verdict in self.rows():
            if text:
                yield f"{text} ({source})"
            yield f"    {measure:<52} {value:<28} {runs:>3} runs  {verdict}"

    def as_json(self) -> dict[str, Any]:
        """Plain values; what was not measured is null."""
        return {
            "figure": self.recipe.figure,
            "title": self.recipe.label,
            "stand_in": self.recipe.stands_in,
            "claims": [
                {
                    "claim": entry.claim.text,
                    "source": entry.claim.source,
                    "measure": entry.measure,
                    **json_values(asdict(entry.finding.value)),
                    "runs": entry.finding.runs,
                    "verdict": entry.finding.verdict,
                }
                for entry in self.entries
            ],
        }


def table(recipe: Recipe, summaries: Mapping[str, Summary], initial: int) -> Table:
    """Hold comparisons against a recipe's claims.

    Args:
        recipe: of the figure.
        summaries: of its panels, by name.
        initial: shared random trials of their runs.

    Returns:
        One entry for every number that a claim rests on.
    """
    return Table(
        recipe,
        tuple(
            Entry(claim, evidence.measure, evidence.finding(summaries, initial))
            for claim in recipe.claims
            for evidence in claim.evidence
        ),
    )


def publish(reproduction: Reproduction, found: Table) -> tuple[Path, Path]:
    """Write the table beside its panels, as Markdown and as JSON.

    Args:
        reproduction: whose results they are.
        found: the table.

    Returns:
        Paths of the Markdown and of the JSON.

    Raises:
        UserError: the folder cannot be written.
    """
    stem = reproduction.results / reproduction.recipe.figure
    text, data = stem.with_suffix(".md"), stem.with_suffix(".json")
    with writing(reproduction.results):
        write_text(text, "\n".join(_page(reproduction, found)) + "\n")
        write_json(data, {**found.as_json(), **_settings(reproduction)})
    return text, data


def _page(reproduction: Reproduction, found: Table) -> Iterator[str]:
    recipe = reproduction.recipe
    yield f"# {recipe.figure}: {recipe.label}"
    yield ""
    yield ", ".join(f"{name} {value}" for name, value in _settings(reproduction).items() if value)
    for panel in recipe.panels:
        yield ""
        yield f"![{panel.title}]({panel.name}/{FIGURE})"
        yield ""
        yield f"*{panel.label}; all numbers in [{panel.name}/{PAGE}]({panel.name}/{PAGE})*"
    yield ""
    yield "| " + " | ".join(_HEADER) + " |"
    yield "|---" * len(_HEADER) + "|"
    for row in found.rows():
        yield "| " + " | ".join(row) + " |"


def _settings(reproduction: Reproduction) -> dict[str, Any]:
    return {
        "data": reproduction.recipe.data,
        "episodes": reproduction.episodes,
        "preset": reproduction.scale.preset if reproduction.trains else "",
        "models": ", ".join(str(path) for path in reproduction.models.values()),
        "runs": reproduction.runs,
    }
