"""What a comparison is of; what cannot be compared is refused here, before Ray and before the first run."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cluster.comparison.folder import CANDIDATES, DECLARED, NO_CANDIDATES, ComparisonFolder
from cluster.comparison.records import RunKey, Runs
from cluster.comparison.worker import ComparisonJob
from cluster.config import CompareSettings
from cluster.errors import UsageError, UserError
from cluster.inputs import usage_errors
from cluster.optimization import methods
from cluster.optimization.candidates import TABLE, require_usable
from cluster.optimization.models import trained_model
from cluster.progress import say
from svaedc.analysis.seeds import common_purpose
from workers.dataset.shards import sha256
from workers.hardware import robots
from workers.physics import ranges
from workers.rollout import VERSION
from workers.setups import Setup
from workers.setups.declared import declaration


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

    def require(self, models: Sequence[Path], candidates: Path | None) -> None:
        """Refuse methods that lack their model, or their candidates.

        Args:
            models: folders of trained ones.
            candidates: folder of simulated ones; None for none.

        Raises:
            UsageError: a method needs what there is none of.
        """
        simulated = [name for name in self.methods if methods.needs_candidates(name)]
        if simulated and candidates is None:
            raise UsageError(
                f"{', '.join(simulated)} need candidates that were simulated: make some with "
                "`svaedc candidates` and name their folder with --candidates"
            )
        if self.with_model() and not models:
            raise UsageError(
                f"{', '.join(self.with_model())} need a trained model: name its folder with --model"
            )

    def require_purpose(self, folder: ComparisonFolder, seeds: Iterable[int]) -> None:
        """Refuse to mix runs for tuning and runs for reporting in one folder.

        Args:
            folder: of the comparison, for the message.
            seeds: of the runs that the folder holds.

        Raises:
            UserError: the folder's seeds are for something else.
        """
        try:
            common_purpose([*seeds, *self.seeds])
        except ValueError as error:
            raise UserError(
                f"{folder} holds runs of another purpose; choose another folder with --out: {error}"
            ) from error


def run_parameters(keys: Iterable[RunKey]) -> dict[str, Any]:
    """What a page says of runs of several commands: all methods, all seeds."""
    found = list(keys)
    runs = sorted({key.run for key in found})
    return {
        "methods": ", ".join(sorted({key.method for key in found})),
        "seed": f"{runs[0]} to {runs[-1]}" if runs else "",
        "runs": len(runs),
    }


@dataclass(frozen=True)
class ComparisonPlan:
    """A comparison before it begins.

    Attributes:
        setup: whose controllers are tried.
        grid: methods and seeds.
        job: what all runs share.
        model: SHA-256 of the checkpoint, of several joined by +; "" when no method asked for needs one.
        trained_on: the setup of the model's data where it is another one; "" elsewhere.
        slots: runs at a time.
        caption: of figure and page, before what they say themselves.
        candidates: SHA-256 of the table of candidates; `NO_CANDIDATES` for none.
    """

    setup: Setup
    grid: Grid
    job: ComparisonJob
    model: str
    trained_on: str
    slots: int
    caption: str
    candidates: str = NO_CANDIDATES

    @property
    def identity(self) -> Mapping[str, Any]:
        """What all runs of its folder have in common, beside the model."""
        return {
            "setup": self.setup.name,
            "setup_digest": self.setup.code,
            "gap": self.job.gap,
            "pool_size": self.job.pool_size,
            "initial_trials": self.job.initial,
            "rollout_version": VERSION,
            CANDIDATES: self.candidates,
            **({DECLARED: declaration(self.setup)} if self.setup.code else {}),
        }

    @property
    def parameters(self) -> dict[str, Any]:
        """What the MLflow run says of the command, besides the identity."""
        return {
            "methods": ", ".join(self.grid.methods),
            "runs": self.grid.runs,
            "trials": self.job.trials,
            "seed": self.grid.seed,
            "slots": self.slots,
            **({"model_trained_on": self.trained_on} if self.trained_on else {}),
        }

    def claim(self) -> dict[str, Any]:
        """Begin the comparison in its folder, or check that the one that is there is this one.

        Returns:
            What all its runs have in common, the model included.

        Raises:
            UserError: the folder holds another comparison, or runs whose seeds are for something else.
        """
        self.grid.require_purpose(self.job.folder, {key.run for key in self.job.folder.begun_keys()})
        codes = {name: methods.code(name) for name in self.grid.methods}
        own = {name: code for name, code in codes.items() if code}
        return self.job.folder.claim(self.identity, self.model, own)

    def missing(self, runs: Runs) -> list[RunKey]:
        """The runs asked for that are not whole."""
        return [key for key in self.grid.keys() if len(runs.get(key, ())) < self.job.length]  # noqa: SIM118

    def require_length(self, runs: Runs) -> None:
        """Refuse runs that would never be compared, and name those that no longer will: the longest are.

        Raises:
            UserError: other runs have more trials.
        """
        folder, longest = self.job.folder, max(map(len, runs.values()), default=0)
        suggested = longest - self.job.initial
        if self.missing(runs) and longest > self.job.length:
            raise UserError(
                f"{folder} holds runs of {suggested} suggested trials, and only the longest are compared: "
                f"ask for --trials {suggested}, or choose another folder with --out"
            )
        others = {key.method for key in runs.keys() - self.grid.keys() if len(runs[key]) < self.job.length}
        if others:
            say(f"runs of {', '.join(sorted(others))} in {folder} have fewer trials: they are not compared")


def plan_comparison(
    *,
    setup: Setup,
    grid: Grid,
    trials: int,
    gap: str,
    models: Sequence[Path],
    folder: Path,
    settings: CompareSettings,
    caption: str = "",
    candidates: Path | None = None,
) -> ComparisonPlan:
    """Check what is to be compared, before anything is written.

    Args:
        setup: whose controllers are tried.
        grid: methods and seeds.
        trials: suggested in each run.
        gap: level of the hidden physics, or its ranges written out.
        models: folders of those trained on the setup, or on the one it stands in for. With several, the
            runs of a seed take the one whose turn it is, so that intervals speak of trainings as well.
        folder: of the results.
        settings: of the runs.
        caption: of figure and page, before what they say themselves.
        candidates: folder of simulated ones, which all runs choose among; None where each draws its own.

    Returns:
        A comparison that can be run.

    Raises:
        UsageError: a gap level does not exist, a gap's range is impossible, or a method lacks its model.
        UserError: the model cannot be read, is of another setup or predicts no badness, or the pool has
            fewer controllers than a run has trials.
    """
    with usage_errors():
        setup.gap(gap)
    grid.require(models, candidates)
    table = candidates / TABLE if candidates is not None else None
    found = [usable(model, setup) for model in models] if grid.with_model() else []
    paths, trained_on = [path for path, _ in found], {name for _, name in found if name != setup.name}
    job = ComparisonJob(
        folder=ComparisonFolder(folder.resolve()),
        setup=setup.name,
        gap=str(ranges(gap)) if "=" in gap else gap,  # so that equal ranges are one comparison
        models=tuple(str(path.resolve()) for path in paths),
        pool_size=settings.pool_size,
        initial=settings.initial_trials,
        trials=trials,
        episode_timeout=settings.episode_timeout_seconds,
        candidates=str(table.resolve()) if table is not None else "",
    )
    if table is not None:
        require_usable(table, setup, paths, settings.initial_trials)
    try:
        job.require(grid.methods, setup)
    except LookupError as error:
        raise UsageError(str(error.args[0])) from error
    except ValueError as error:
        raise UserError(f"cannot compare (compare.pool_size is {settings.pool_size}): {error}") from error
    return ComparisonPlan(
        setup=setup,
        grid=grid,
        job=job,
        model="+".join(map(sha256, paths)),
        trained_on=", ".join(sorted(trained_on)),
        slots=settings.slots,
        caption=caption,
        candidates=sha256(table) if table is not None else NO_CANDIDATES,
    )


def usable(model: Path, setup: Setup) -> tuple[Path, str]:
    """Read a model and refuse one that was trained on another setup.

    Args:
        model: folder that `svaedc train` left, or the checkpoint in it.
        setup: that is compared on.

    Returns:
        Path of the checkpoint, and the setup it was trained on: this one, or the one that it stands in for.

    Raises:
        UserError: it cannot be read, or was trained on another one.
    """
    found = trained_model(model, setup.name, robots.stands_in_for(setup.name))
    return found.path, str(found.metadata["setup"])
