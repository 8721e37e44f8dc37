"""`svaedc dataset export`: the episodes in other formats, whole or not at all."""

import shutil
from collections.abc import Callable, Iterator, Mapping
from glob import escape
from pathlib import Path

from cluster.errors import UsageError, UserError, nearest
from cluster.progress import ProgressLine
from workers.dataset.exports.lerobot import export_lerobot
from workers.dataset.exports.npz import export_npz
from workers.dataset.folder import Dataset
from workers.dataset.shards import Shard
from workers.dataset.storage.temporary import is_dead, writer

FORMATS: Mapping[str, Callable[[Dataset, Path], Iterator[Shard]]] = {
    "npz": export_npz,
    "lerobot": export_lerobot,
}


def export(dataset: Dataset, form: str, out: Path) -> None:
    """Write a dataset in another format; the folder appears when it is complete.

    Args:
        dataset: whose episodes are written.
        form: one of `FORMATS`.
        out: folder that does not exist yet.

    Raises:
        UsageError: the format is unknown.
        UserError: the folder exists already, or the dataset is empty, damaged or overlapping.
    """
    if form not in FORMATS:
        raise UsageError(f"unknown format {form!r}, {nearest(form, FORMATS)}")
    if out.exists():
        raise UserError(f"{out} exists already; choose a new folder, an export never writes into one")
    if not dataset.episodes():
        raise UserError(f"{dataset.folder} holds no episodes yet; collect some first")
    _sweep(out)
    building = out.with_name(f"{out.name}.{writer()}")
    building.mkdir(parents=True)
    try:
        with ProgressLine("episodes", dataset.episodes(), 0) as progress:
            for shard in FORMATS[form](dataset, building):
                progress.advance(shard.episodes, form)
        building.rename(out)
    except ValueError as error:
        raise UserError(
            f"{error}; `svaedc dataset verify {dataset.folder}` lists everything that is wrong"
        ) from error
    finally:
        shutil.rmtree(building, ignore_errors=True)


def _sweep(out: Path) -> None:
    """Remove what exports to the same place left behind that were killed."""
    for path in out.parent.glob(f"{escape(out.name)}.*"):
        if is_dead(path.name.removeprefix(f"{out.name}.")):
            shutil.rmtree(path, ignore_errors=True)
