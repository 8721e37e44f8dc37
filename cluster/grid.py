"""Which runs of a comparison are asked for; what cannot be run is refused before anything starts."""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cluster.errors import UsageError, UserError
from cluster.options import usage_errors
from cluster.results import RunKey
from svaedc import methods
from svaedc.seeds import common_purpose


@dataclass(frozen=True)
class Grid:
    """Every method with every seed."""

    methods: tuple[str, ...]
    seed: int
    runs: int

    def __post_init__(self) -> None:
        """Refuse a grid without runs, unknown or repeated methods, and seeds of two purposes."""
        if not self.methods:
            raise UsageError(f"--methods must name at least one of {', '.join(methods.names())}, got none")
        if len(set(self.methods)) < len(self.methods):
            raise UsageError(f"--methods must name each method once, got {', '.join(self.methods)}")
        if self.runs < 1:
            raise UsageError(f"--runs must be at least 1, got {self.runs}")
        with usage_errors():
            self.with_model()
        try:
            common_purpose(self.seeds)
        except ValueError as error:
            raise UsageError(f"--seed and --runs: {error}") from error

    @property
    def seeds(self) -> range:
        """Of the runs of each method."""
        return range(self.seed, self.seed + self.runs)

    def keys(self) -> list[RunKey]:
        """All runs; the methods of a seed follow each other, so that partial results compare."""
        return [RunKey(method, run) for run in self.seeds for method in self.methods]

    def with_model(self) -> list[str]:
        """The methods that need a trained model."""
        return [name for name in self.methods if methods.needs_model(name)]

    def require(self, model: Path | None) -> None:
        """Refuse methods that lack their model.

        Raises:
            UsageError: a method needs a model, and there is none.
        """
        if self.with_model() and model is None:
            raise UsageError(
                f"{', '.join(self.with_model())} need a trained model: name its folder with --model"
            )

    def require_purpose(self, folder: Path, seeds: Iterable[int]) -> None:
        """Refuse to mix runs for tuning and runs for reporting in one folder.

        Raises:
            UserError: the folder's seeds are for something else.
        """
        try:
            common_purpose([*seeds, *self.seeds])
        except ValueError as error:
            raise UserError(
                f"{folder} holds runs of another purpose; choose another folder with --out: {error}"
            ) from error


def described(keys: Iterable[RunKey]) -> dict[str, Any]:
    """What a page says of runs of several commands: all methods, all seeds."""
    found = list(keys)
    runs = sorted({key.run for key in found})
    return {
        "methods": ", ".join(sorted({key.method for key in found})),
        "seed": f"{runs[0]} to {runs[-1]}" if runs else "",
        "runs": len(runs),
    }
