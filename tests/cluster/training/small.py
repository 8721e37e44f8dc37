"""A training that takes seconds, and models compared bit for bit."""

from pathlib import Path

import torch

from cluster.config import TrainSettings
from svaedc.model import checkpoint


def settings(cache: Path, **changes) -> TrainSettings:
    return TrainSettings(
        **{"updates": 40, "epoch_updates": 20, "threads": 1, "moments": 0, "cache_folder": cache, **changes}
    )


def weights(path: Path) -> dict[str, torch.Tensor]:
    return checkpoint.load(path)[0].state_dict()


def same(first: dict[str, torch.Tensor], second: dict[str, torch.Tensor]) -> bool:
    return first.keys() == second.keys() and all(torch.equal(first[name], second[name]) for name in first)
