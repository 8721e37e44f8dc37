"""`svaedc dataset verify --rederive` and `repair`: rolling out shards again, in this process."""

import numpy as np

from cluster.errors import UserError
from cluster.inputs import setup_of
from cluster.progress import ProgressLine, say
from svaedc.analysis.words import quantity
from workers.collection.recompute import draw_shards, find_broken, rederive, repair
from workers.collection.shard import require_same_code
from workers.dataset.folder import Dataset
from workers.dataset.inventory import manifest_differences
from workers.dataset.manifest import MANIFEST
from workers.dataset.shards import Shard
from workers.dataset.verification import Defect
from workers.setups import Setup


def recompute_shards(dataset: Dataset, count: int) -> list[Defect]:
    """Roll some random shards out again, and see what is wrong with them.

    Args:
        dataset: from which they are drawn.
        count: how many; all of them if there are fewer.

    Returns:
        A line for each defect.

    Raises:
        UserError: this machine would roll out other episodes.
    """
    setup = _setup_of(dataset)
    chosen = draw_shards(dataset, count, np.random.default_rng())
    found: list[Defect] = []
    say(f"rolling out again: {', '.join(shard.name for shard in chosen) or 'nothing, there are no shards'}")
    with ProgressLine("episodes", sum(shard.episodes for shard in chosen), 0) as progress:
        for shard in chosen:
            found += rederive(setup, dataset, shard)
            progress.advance(shard.episodes, quantity(len(found), "problem"))
    return found


def repair_dataset(dataset: Dataset) -> None:
    """Put every broken or lost shard right, and say which.

    Raises:
        UserError: this machine would roll out other episodes than the broken files shall hold, or it is
            `dataset.json` that is wrong.
    """
    differences = manifest_differences(dataset)
    if differences:
        raise UserError(
            f"no shard belongs to {dataset.folder / MANIFEST}; they differ in {'; '.join(differences)}. "
            "Nothing is repaired: remove that file, and `svaedc collect` with the options of the shards "
            "writes it anew"
        )
    wrong = _broken_shards(dataset)
    if not wrong:
        say(f"no file of {dataset.folder} is broken or lost: nothing to repair")
        return
    setup = _setup_of(dataset)
    with ProgressLine("episodes", sum(shard.episodes for shard in wrong), 0) as progress:
        for shard in wrong:
            say(f"{shard.name} {repair(setup, dataset, shard).value}")
            progress.advance(shard.episodes, "repaired")


def _broken_shards(dataset: Dataset) -> list[Shard]:
    wrong = []
    with ProgressLine("episodes", dataset.episodes(), 0) as progress:
        for shard, is_wrong in find_broken(dataset):
            if is_wrong:
                wrong.append(shard)
            progress.advance(shard.episodes, f"{len(wrong)} to repair")
    return wrong


def _setup_of(dataset: Dataset) -> Setup:
    """The dataset's setup, if it still rolls out the same episodes here."""
    identity = dataset.identity
    setup = setup_of(identity.setup, identity.bad_name).under(identity.gap)
    try:
        require_same_code(setup, dataset)
    except ValueError as error:
        raise UserError(str(error)) from error
    return setup
