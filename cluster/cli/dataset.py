"""`svaedc dataset`: what is in a dataset, and whether it is whole."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from cluster.datasets.export import export
from cluster.datasets.quarantine import quarantined_shards
from cluster.datasets.repair import recompute_shards, repair_dataset
from cluster.errors import UserError
from cluster.inputs import dataset_location, durable
from cluster.progress import ProgressLine
from cluster.runtime.signals import interruptible, terminating_as_exit
from workers.dataset.folder import Dataset, open_dataset
from workers.dataset.identity import Identity
from workers.dataset.inventory import inventory
from workers.dataset.repeats import irreducible
from workers.dataset.statistics import Statistics, statistics
from workers.dataset.storage.location import Location
from workers.dataset.verification import Defect, gaps, overlaps, verify

app = typer.Typer(no_args_is_help=True, help="Look into a dataset, prove that it is whole, or repair it.")

Folder = Annotated[
    Any,  # a Location, which typer does not know
    typer.Argument(
        metavar="PLACE", help="Folder of the dataset, or s3://bucket/prefix.", parser=dataset_location
    ),
]


def _open(folder: Location) -> Dataset:
    try:
        return open_dataset(folder)
    except ValueError as error:
        raise UserError(str(error)) from error


@app.command()
def info(folder: Folder) -> None:
    """What a dataset is and what its episodes are like."""
    dataset = _open(folder)
    identity = dataset.identity
    table = Table(show_header=False, box=None)
    episodes, kilobytes = dataset.episodes(), dataset.size() / 1e3
    rows = {
        "setup": identity.setup,
        "episodes": f"{episodes} in {len(dataset.shards())} shards",
        "size": f"{kilobytes / 1e3:.1f} MB, {kilobytes / max(episodes, 1):.1f} kB an episode",
        "each": f"{identity.horizon} steps of {identity.control_step * 1e3:g} ms",
        "observation": f"{len(identity.observation)} channels, stored as {identity.storage}",
        "controller": f"{len(identity.parameters)} parameters",
        "seed": str(identity.seed),
        "G_bad": _g_bad(identity),
        "repeats": f"{identity.repeats} of each controller",
        "identity": identity.digest,
        "fingerprint": dataset.fingerprint(),
        "made with": f"pybullet {identity.pybullet}, numpy {identity.numpy}",
        "put aside": ", ".join(shard.name for shard in quarantined_shards(dataset)) or "none",
    }
    try:
        rows |= _table_rows(statistics(dataset)) if episodes else {}
        rows |= _irreducible(dataset) if identity.repeats > 1 else {}
    except ValueError as error:
        raise UserError(
            f"{error}; `svaedc dataset verify {folder}` lists everything that is wrong"
        ) from error
    for name, value in rows.items():
        table.add_row(name, value)
    Console().print(table)


def _table_rows(found: Statistics) -> dict[str, str]:
    return {
        "objective": "  ".join(f"{value:+.2f}" for value in found.objective)
        + "  (min, 5, 25, 50, 75, 95 %, max)",
        "badness": f"{found.badness:.3f} on average",
        "bad steps": ", ".join(f"{name} {share:.3f}" for name, share in found.bad_steps.items()),
        "diverged": str(found.diverged),
        "stopped": ", ".join(f"{count} {reason}" for reason, count in found.stopped.items()) or "0",
    }


def _g_bad(identity: Identity) -> str:
    name = f"{identity.bad_name} ({identity.bad_digest[:12]})" if identity.bad_name else "the setup's own"
    return f"{name}, {identity.bad_kind}"


def _irreducible(dataset: Dataset) -> dict[str, str]:
    """What the controller does not decide."""
    found = irreducible(dataset)
    if found is None:
        return {"irreducible": "unknown: fewer than two controllers have all their repeats"}
    low, high = found.xi
    return {
        "irreducible": f"{found.y:.2f} of the variance of y, {found.f:.2f} of that of f "
        f"({found.controllers} controllers); of xi, {low:.2f} to {high:.2f} of the error of its median"
    }


@app.command(name="verify")
def verify_command(
    folder: Folder,
    rederive: Annotated[
        int, typer.Option("--rederive", metavar="K", min=0, help="Roll out K random shards again as well.")
    ] = 0,
) -> None:
    """Check every byte and row; exits with 1, names each broken file and each gap. Changes nothing."""
    dataset = _open(folder)
    found = [*inventory(dataset), *_problems_in_files(dataset)]
    if rederive:
        with interruptible("nothing was changed"), terminating_as_exit():
            found += recompute_shards(dataset, rederive)
    uncollected = list(gaps(dataset))
    for problem in found:
        typer.echo(f"{problem.file}: {problem.what}")
    for gap in uncollected:
        typer.echo(f"episodes {gap.start} to {gap.stop - 1} are not collected yet")
    if found:
        raise UserError(
            f"{len(found)} problems in {folder}; `svaedc dataset repair {folder}` recomputes what is broken "
            "or missing and keeps what it replaces"
        )
    if uncollected:
        raise UserError(
            f"every file in {folder} is whole, but episodes between them are not collected yet; "
            "run `svaedc collect` again: it collects exactly those"
        )
    typer.echo(f"{folder} is whole: {dataset.episodes()} episodes in {len(dataset.shards())} shards")


def _problems_in_files(dataset: Dataset) -> list[Defect]:
    found: list[Defect] = []
    with ProgressLine("episodes", dataset.episodes(), 0) as progress:
        for shard, problems in verify(dataset):
            found += problems
            progress.advance(shard.episodes, f"{len(found)} problems")
    return found


@app.command(name="repair")
def repair_command(folder: Folder) -> None:
    """Roll out broken and lost shards again and put them in place; keeps what it replaces."""
    dataset = _open(folder)
    with interruptible(), terminating_as_exit():
        repair_dataset(dataset)
    left = [*inventory(dataset), *overlaps(dataset)]
    for problem in left:
        typer.echo(f"{problem.file}: {problem.what}")
    if left:
        raise UserError(
            f"{len(left)} problems in {folder} are none of broken files; look at the files named above and "
            "remove what does not belong there"
        )


@app.command(name="export")
def export_command(
    folder: Folder,
    form: Annotated[str, typer.Option("--format", help="npz (NumPy archives) or lerobot (v3.0).")],
    out: Annotated[Path, typer.Option("--out", help="A new folder.", callback=durable)],
) -> None:
    """Write the episodes in another format, one shard in memory at a time."""
    dataset = _open(folder)
    with interruptible("nothing of it is kept, and the same command begins anew"), terminating_as_exit():
        export(dataset, form, out)
    typer.echo(f"{out} holds {dataset.episodes()} episodes")
