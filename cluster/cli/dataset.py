"""`svaedc dataset`: what is in a dataset, and whether it is whole."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cluster.cli.documents import one_document
from cluster.cli.output import show
from cluster.errors import UserError
from cluster.inputs import dataset_location, durable
from svaedc.analysis.words import quantity

if TYPE_CHECKING:
    from workers.dataset.folder import Dataset
    from workers.dataset.storage.location import Location

app = typer.Typer(no_args_is_help=True, help="Look into a dataset, prove that it is whole, or repair it.")

Folder = Annotated[
    Any,  # a Location, which typer does not know
    typer.Argument(
        metavar="PLACE", help="Folder of the dataset, or s3://bucket/prefix.", parser=dataset_location
    ),
]
AsJson = Annotated[
    bool,
    typer.Option(
        "--json",
        help="Print one JSON document, and nothing else, on standard output: folder, setup, episodes, "
        "shards, bytes, horizon, control_step (s), channels, parameters, storage, seed, repeats, bad, "
        "identity, fingerprint, pybullet, numpy and further packages by name, put_aside, statistics (null "
        "without episodes), irreducible (null without repeats), notes. What has no number is null.",
    ),
]


def _open(folder: "Location") -> "Dataset":
    from workers.dataset.folder import open_dataset

    try:
        return open_dataset(folder)
    except ValueError as error:
        raise UserError(str(error)) from error


@app.command()
def info(folder: Folder, *, as_json: AsJson = False) -> None:
    """What a dataset is and what its episodes are like."""
    if as_json:
        from cluster.datasets.facts import dataset_facts

        with one_document() as document:
            document |= dataset_facts(_open(folder))
        return
    from rich.table import Table

    from cluster.datasets.info import dataset_info

    table = Table(show_header=False, box=None)
    for name, value in dataset_info(_open(folder)).items():
        table.add_row(name, value)
    show(table)


@app.command(name="verify")
def verify_command(
    folder: Folder,
    rederive: Annotated[
        int, typer.Option("--rederive", metavar="K", min=0, help="Roll out K random shards again as well.")
    ] = 0,
) -> None:
    """Check every byte and row; exits with 1, names each broken file and each gap. Changes nothing."""
    from cluster.datasets.verify import find_defects
    from cluster.runtime.signals import interruptible, terminating_as_exit
    from workers.dataset.verification import gaps

    dataset = _open(folder)
    with interruptible("nothing was changed"), terminating_as_exit():
        found = find_defects(dataset, rederive)
    uncollected = list(gaps(dataset))
    for defect in found:
        typer.echo(f"{defect.file}: {defect.what}")
    for gap in uncollected:
        typer.echo(f"episodes {gap.start} to {gap.stop - 1} are not collected yet")
    if found:
        raise UserError(
            f"{quantity(len(found), 'problem')} in {folder}; `svaedc dataset repair {folder}` recomputes "
            "what is broken or missing and keeps what it replaces"
        )
    if uncollected:
        raise UserError(
            f"every file in {folder} is whole, but episodes between them are not collected yet; "
            "run `svaedc collect` again: it collects exactly those"
        )
    held = f"{quantity(dataset.episodes(), 'episode')} in {quantity(len(dataset.shards()), 'shard')}"
    typer.echo(f"{folder} is whole: {held}")


@app.command(name="repair")
def repair_command(folder: Folder) -> None:
    """Roll out broken and lost shards again and put them in place; keeps what it replaces."""
    from cluster.datasets.repair import repair_dataset
    from cluster.runtime.signals import interruptible, terminating_as_exit
    from workers.dataset.inventory import inventory
    from workers.dataset.verification import overlaps

    dataset = _open(folder)
    with interruptible(), terminating_as_exit():
        repair_dataset(dataset)
    left = [*inventory(dataset), *overlaps(dataset)]
    for defect in left:
        typer.echo(f"{defect.file}: {defect.what}")
    if left:
        raise UserError(
            f"{quantity(len(left), 'problem')} in {folder}, none of broken files; look at the files named "
            "above and remove what does not belong there"
        )


@app.command(name="export")
def export_command(
    folder: Folder,
    form: Annotated[str, typer.Option("--format", help="npz (NumPy archives) or lerobot (v3.0).")],
    out: Annotated[Path, typer.Option("--out", help="A new folder.", callback=durable)],
) -> None:
    """Write the episodes in another format, one shard in memory at a time."""
    from cluster.datasets.export import export
    from cluster.runtime.signals import interruptible, terminating_as_exit

    dataset = _open(folder)
    with interruptible("nothing of it is kept, and the same command begins anew"), terminating_as_exit():
        export(dataset, form, out)
    typer.echo(f"{out} holds {quantity(dataset.episodes(), 'episode')}")
