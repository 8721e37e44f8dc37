"""Where a process trains: alone or among others, and in which precision."""

from collections.abc import Callable
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import Final

import torch
from torch import nn

from svaedc.data.samplers import ALONE, WorkerRank

PRECISIONS: Final = {"float32": torch.float32, "bfloat16": torch.bfloat16}
"""Matrix products and convolutions have one of these. Weights, densities and sums are float32 in either, and
bfloat16 has float32's range, so that no loss needs scaling."""


def same_module(module: nn.Module) -> nn.Module:
    """The module itself: nobody shares the work."""
    return module


def same_decision(decision: bool) -> bool:  # noqa: FBT001
    """The decision itself: nobody else has one."""
    return decision


@dataclass(frozen=True)
class DistributedContext:
    """What a training process must know of its surroundings; nothing here changes what is learnt but noise.

    Attributes:
        shard: This worker among those that train together.
        parallelize: Wraps what each stage optimises, for example in DistributedDataParallel.
        agree: Rank 0's decision, on every rank; asked by all ranks at the same points.
        precision: `float32`, or `bfloat16` for mixed precision, which pays on a GPU.
    """

    shard: WorkerRank = ALONE
    parallelize: Callable[[nn.Module], nn.Module] = same_module
    agree: Callable[[bool], bool] = same_decision
    precision: str = "float32"

    def __post_init__(self) -> None:
        """Refuse an unknown precision."""
        if self.precision not in PRECISIONS:
            raise ValueError(f"precision must be one of {', '.join(PRECISIONS)}, got {self.precision!r}")

    def autocast(self, device: torch.device) -> AbstractContextManager[None]:
        """Block in which networks compute in this precision."""
        is_mixed = self.precision != "float32"
        return torch.autocast(device.type, PRECISIONS[self.precision], enabled=is_mixed)


SINGLE_PROCESS: Final = DistributedContext()
