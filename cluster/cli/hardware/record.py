"""The record of a campaign: files of its trials, tables, a page."""

from pathlib import Path
from typing import Annotated

import typer

from cluster.cli.hardware.arguments import Folder, TrialNumber, Who
from cluster.inputs import durable
from cluster.progress import say


def attach(
    folder: Folder,
    trial: TrialNumber,
    file: Annotated[Path, typer.Argument(help="A video, a log, a photograph.", callback=durable)],
    who: Who,
    note: Annotated[str, typer.Option("--note", help="What it shows; kept in the record.")] = "",
) -> None:
    """Keep a copy of a file with a trial; what the robot recorded is kept by itself."""
    from cluster.hardware import operator

    kept = operator.attach(folder, trial, file, who, note)
    say(f"{kept.name} is kept with trial {kept.trial} as {kept.file}")


def export(
    folder: Folder,
    form: Annotated[
        str,
        typer.Option("--as", help="jsonl: the whole journal. csv, parquet: a row for every trial."),
    ] = "jsonl",
    out: Annotated[
        Path | None, typer.Option("--out", help="File to write instead of printing.", callback=durable)
    ] = None,
) -> None:
    """Print the whole journal as JSON lines, or every trial as a row of a table."""
    from cluster.hardware.record.export import export as written

    typer.echo(written(folder, form, out), nl=False)


def report(
    folder: Folder,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="File to write; by default report.html in the folder.", callback=durable),
    ] = None,
) -> None:
    """Write the campaign as one page: every trial, decision and note, predictions beside measurements."""
    from cluster.hardware.record.export import report as write_report

    path = out or folder / "report.html"
    write_report(folder, path)
    say(f"wrote {path}")
