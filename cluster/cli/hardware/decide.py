"""What a person decides about the trials of a campaign."""

from typing import Annotated

import typer

from cluster.cli.hardware.arguments import Confirmed, Folder, Home, Note, TrialNumber, Who
from cluster.cli.hardware.campaigns import show_campaign


def approve(
    folder: Folder,
    trial: TrialNumber,
    who: Who,
    minutes: Annotated[float, typer.Option("--minutes", help="The approval holds so long.")] = 60.0,
) -> None:
    """Let a checked trial onto the robot: this controller, under these limits, for a while."""
    from cluster.hardware import operator

    operator.approve(folder, trial, who, minutes)
    show_campaign(operator.status(folder))


def withdraw(folder: Folder, trial: TrialNumber, who: Who) -> None:
    """Take an approval back, as long as the trial has not begun."""
    from cluster.hardware import operator

    operator.withdraw(folder, trial, who)
    show_campaign(operator.status(folder))


def reject(folder: Folder, trial: TrialNumber, who: Who, note: Note) -> None:
    """Keep a trial off the robot; neither it nor one near it is suggested again."""
    from cluster.hardware import operator

    operator.reject(folder, trial, who, note)
    show_campaign(operator.status(folder))


def adopt(folder: Folder, who: Who, home: Home = None) -> None:
    """Vouch for a campaign that moved the robot under another home."""
    from cluster.hardware import operator

    operator.adopt(folder, who, home)
    show_campaign(operator.status(folder))


def resolve(
    folder: Folder,
    trial: TrialNumber,
    outcome: Annotated[str, typer.Option("--outcome", help="measured, failed or aborted.")],
    who: Who,
    note: Note,
    f: Annotated[float | None, typer.Option("--f", help="Objective, of a measured trial.")] = None,
    y: Annotated[float | None, typer.Option("--y", help="Badness in [0, 1], of a measured trial.")] = None,
    confirm: Confirmed = None,
) -> None:
    """Say what became of an unknown trial, once the robot stands still and is reset."""
    from cluster.hardware import operator

    operator.resolve(folder, trial, outcome, who, note, f, y, confirm)
    show_campaign(operator.status(folder))


def amend(
    folder: Folder,
    trial: TrialNumber,
    who: Who,
    note: Note,
    f: Annotated[float, typer.Option("--f", help="Objective.")],
    y: Annotated[float, typer.Option("--y", help="Badness in [0, 1].")],
    confirm: Confirmed = None,
) -> None:
    """Correct what a trial measured; the old value stays in the journal."""
    from cluster.hardware import operator

    operator.amend(folder, trial, who, note, f, y, confirm)
    show_campaign(operator.status(folder))
