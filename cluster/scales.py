"""How much of the paper's data and training a figure is made with."""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True)
class Scale:
    """How much of the paper's data and training.

    Attributes:
        preset: of training.
        episodes: by setup.
    """

    preset: str
    episodes: Mapping[str, int]


_DATA = ("franka", "yumi", "daisy-27d", "daisy-11d")
SCALES: Final[Mapping[str, Scale]] = MappingProxyType(
    {
        "machine": Scale("compact", dict(zip(_DATA, (50_000, 20_000, 10_000, 10_000), strict=True))),
        "paper": Scale("paper", dict.fromkeys(_DATA, 500_000)),
    }
)
"""`paper`: sections 6.1 and 7.1, on a cluster with GPUs. `machine`: an hour or two of two cores."""


def scale(name: str) -> Scale:
    """The scale of that name.

    Raises:
        LookupError: there is none.
    """
    if name not in SCALES:
        raise LookupError(f"no scale called {name!r}; there are {', '.join(SCALES)}")
    return SCALES[name]
