"""`svaedc setups`: what setups there are, and how far two of them agree."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.documents import one_document
from cluster.cli.listings import list_setups
from cluster.cli.options import Seed
from cluster.inputs import durable, setup_of

app = typer.Typer(invoke_without_command=True)


@app.callback()
def setups(context: typer.Context) -> None:
    """List the setups: name, number of parameters and steps, what it is, and the package it comes from.

    `svaedc setups compare ONE OTHER` tells how far two of them agree.
    """
    if context.invoked_subcommand is None:
        list_setups()


@app.command()
def compare(
    one: Annotated[str, typer.Argument(metavar="ONE", help="A setup, one of `svaedc setups` or your own.")],
    other: Annotated[
        str, typer.Argument(metavar="OTHER", help="Another with the same controllers, or the same one.")
    ],
    controllers: Annotated[int, typer.Option("--controllers", min=5, help="How many, at random.")] = 300,
    seed: Seed = 0,
    gap: Annotated[
        str,
        typer.Option(
            "--gap",
            help="Physics of OTHER: the same as ONE's; a level such as wide, or NAME=LOW:HIGH, drawn anew "
            "for each controller; or a number such as 1e-6, by which share every parameter is larger.",
        ),
    ] = "same",
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="Folder for agreement.json, a picture, and clips of the worst disagreements.",
            callback=durable,
        ),
    ] = None,
    *,
    as_json: Annotated[
        bool,
        typer.Option(
            "--json",
            help="Print one JSON document, and nothing else, on standard output: setups, seed, physics, "
            "controllers, usable, unusable by setup, measures (name, means, spearman, ks, p), success by "
            "setup, best (count, objective, success, kept). What has no number is null.",
        ),
    ] = False,
) -> None:
    """Run the same random controllers in two simulations, and say how far they agree.

    For objective, badness and each bad condition: the means, Spearman's correlation of the ranks (do the
    controllers come in the same order?), and Kolmogorov and Smirnov's distance of the distributions (are
    there as many of each value?). Then what becomes of the best controllers of ONE in OTHER: that is what a
    robot that is not the simulation does to them.

    `svaedc setups compare franka franka-mujoco`

    How much physics alone changes: `svaedc setups compare franka franka --gap wide`
    """
    from cluster.agreement.compare import compare_setups

    first, second = setup_of(one), setup_of(other)
    if not as_json:
        compare_setups(first, second, seed, controllers, gap, out)
        return
    with one_document() as document:
        document.update(compare_setups(first, second, seed, controllers, gap, out))
