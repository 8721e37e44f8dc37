"""`svaedc dataset verify`: everything that is wrong with a dataset, without changing anything."""

from cluster.datasets.repair import recompute_shards
from cluster.progress import ProgressLine
from svaedc.analysis.words import quantity
from workers.dataset.folder import Dataset
from workers.dataset.inventory import inventory
from workers.dataset.verification import Defect, verify


def find_defects(dataset: Dataset, rederive: int) -> list[Defect]:
    """What is wrong with the files of a dataset, and with shards when they are rolled out again.

    Args:
        dataset: that is looked through.
        rederive: how many random shards are rolled out again, at least 0.

    Returns:
        A line for each defect.

    Raises:
        UserError: this machine would roll out other episodes.
    """
    found = [*inventory(dataset), *_defects_in_files(dataset)]
    return found + recompute_shards(dataset, rederive) if rederive else found


def _defects_in_files(dataset: Dataset) -> list[Defect]:
    found: list[Defect] = []
    with ProgressLine("episodes", dataset.episodes(), 0) as progress:
        for shard, defects in verify(dataset):
            found += defects
            progress.advance(shard.episodes, quantity(len(found), "problem"))
    return found
