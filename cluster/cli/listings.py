"""`svaedc setups`, `svaedc methods`, `svaedc robots`: what there is by name, one line each."""

from collections.abc import Iterable
from typing import TYPE_CHECKING

import typer

from cluster.progress import say

if TYPE_CHECKING:
    from cluster.listing import Listed


def list_setups() -> None:
    """Print them."""
    from cluster.listing import listed_setups

    _show(listed_setups())
    say("a setup of your own: --setup MODULE or MODULE:NAME (docs/how-to/plug-ins.md)")


def methods() -> None:
    """List the methods: name, whether it needs a trained model, what it is, and the package it comes from."""
    from cluster.listing import listed_methods

    _show(listed_methods())
    say(
        "most take -pool or -acqf, then -ucb or -ei, behind their name (docs/reference/methods.md); a method "
        "of your own: --methods MODULE:NAME (docs/how-to/plug-ins.md)"
    )


def robots() -> None:
    """List the robots: name, the setup that it realises, what it is, and the package it comes from."""
    from cluster.listing import listed_robots

    _show(listed_robots())
    say("a robot of your own: --robot MODULE:NAME (docs/how-to/plug-ins.md)")


def _show(listed: "Iterable[Listed]") -> None:
    """Plain lines, for eyes and for `grep`: no column is cut."""
    rows = list(listed)
    names, facts = (max((len(text) for text in column), default=0) for column in _columns(rows))
    for row in rows:
        source = f"  [{row.source}]" if row.source else ""
        typer.echo(f"{row.name:<{names}}  {row.facts:<{facts}}  {row.summary}{source}")


def _columns(rows: "list[Listed]") -> tuple[list[str], list[str]]:
    return [row.name for row in rows], [row.facts for row in rows]
