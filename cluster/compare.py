"""`svaedc compare`: plan methods x seeds, submit the runs to Ray Tune, gather their trials, record."""

import json
import os
import shutil
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from statistics import fmean
from typing import Any

from ray import tune
from ray.tune import Callback, FailureConfig, RunConfig, TuneConfig, Tuner

from cluster import figures
from cluster.comparison_job import ComparisonJob, RunTrainable
from cluster.config import CompareSettings
from cluster.errors import UsageError, UserError
from cluster.progress import ProgressLine, say
from cluster.results import RUNS, RunKey, all_runs, recorded, rows, write_table
from cluster.session import Session
from cluster.tracking import Run, Tracker
from svaedc import checkpoint, methods
from svaedc.statistics import Reporting, Summary, summarise
from workers.dataset.shards import sha256
from workers.randomness import generator
from workers.rollout import VERSION
from workers.setups import Setup

_RUN_FAILURES = 2
_IDENTITY = "comparison.json"


@dataclass(frozen=True)
class Grid:
    """Which runs are asked for: every method with every seed."""

    methods: tuple[str, ...]
    seed: int
    runs: int

    def keys(self) -> list[RunKey]:
        """All runs; the methods of a seed follow each other, so that partial results compare."""
        seeds = range(self.seed, self.seed + self.runs)
        return [RunKey(method, run) for run in seeds for method in self.methods]


def compare(
    *,
    setup: Setup,
    grid: Grid,
    trials: int,
    gap: str,
    model: Path | None,
    folder: Path,
    settings: CompareSettings,
    session: Session,
    tracker: Tracker,
) -> Summary:
    """Run what is missing of a comparison, then summarise all of it.

    Raises:
        UsageError: a method or gap level does not exist, or a method lacks its model.
        UserError: the folder holds another comparison, the model is of another setup, or runs kept failing.
    """
    job, missing = _plan(setup, grid, trials, gap, model, folder, settings)
    session.preflight(settings.slots)
    parameters = {
        **json.loads((folder / _IDENTITY).read_text()),
        "methods": ", ".join(grid.methods),
        "runs": grid.runs,
        "trials": trials,
        "seed": grid.seed,
        "slots": settings.slots,
    }
    with tracker.run(f"compare {setup.name}", "compare", parameters) as run:
        if missing:
            _submit(job, missing, len(grid.keys()), settings, run)
        return _record(job, setup, run)


def _plan(
    setup: Setup,
    grid: Grid,
    trials: int,
    gap: str,
    model: Path | None,
    folder: Path,
    settings: CompareSettings,
) -> tuple[ComparisonJob, list[RunKey]]:
    try:
        setup.gap(gap)
        with_model = [name for name in grid.methods if methods.needs_model(name)]
    except LookupError as error:
        raise UsageError(error.args[0]) from error
    if with_model and model is None:
        raise UsageError(f"{', '.join(with_model)} need a trained model: name its folder with --model")
    path = _checkpoint(model, setup) if with_model and model else None
    _claim(folder, _identity(setup, gap, path, settings))
    job = ComparisonJob(
        folder=folder.resolve(),
        setup=setup.name,
        gap=gap,
        model=str(path.resolve()) if path else "",
        pool_size=settings.pool_size,
        initial=settings.initial_trials,
        trials=trials,
    )
    return job, [key for key in grid.keys() if len(recorded(key.path(folder))) < job.length]  # noqa: SIM118


def _checkpoint(model: Path, setup: Setup) -> Path:
    path = model / "model.pt" if model.is_dir() else model
    try:
        _, metadata = checkpoint.load(path)
        checkpoint.require(path, metadata, {"setup": setup.name})
    except (FileNotFoundError, ValueError) as error:
        raise UserError(f"cannot use the model: {error}") from error
    return path


def _identity(setup: Setup, gap: str, model: Path | None, settings: CompareSettings) -> dict[str, Any]:
    return {
        "setup": setup.name,
        "gap": gap,
        "model": sha256(model) if model else "",
        "pool_size": settings.pool_size,
        "initial_trials": settings.initial_trials,
        "rollout_version": VERSION,
    }


def _claim(folder: Path, identity: dict[str, Any]) -> None:
    """Begin a comparison in a folder, or check that the one in it is this one."""
    (folder / RUNS).mkdir(parents=True, exist_ok=True)
    path = folder / _IDENTITY
    if not path.exists():
        path.write_text(json.dumps(identity, indent=2) + "\n")
    found = json.loads(path.read_text())
    for name, value in identity.items():
        if found.get(name) != value:
            raise UserError(
                f"{folder} holds a comparison with {name} {found.get(name)!r}, not {value!r}; "
                "choose another folder with --out"
            )


@dataclass
class _Watch(Callback):
    """Shows trials as they end, and keeps each run in MLflow once it is over."""

    job: ComparisonJob
    progress: ProgressLine
    parent: Run
    best: dict[str, dict[int, float]] = field(default_factory=lambda: defaultdict(dict))

    def on_trial_result(
        self,
        iteration: int,  # noqa: ARG002
        trials: Any,  # noqa: ARG002
        trial: Any,
        result: dict[str, Any],
        **_: Any,
    ) -> None:
        """A trial ended."""
        key = RunKey(**trial.config["run"])
        self.best[key.method][key.run] = result["best"]
        means = ", ".join(f"{method} {fmean(runs.values()):.2f}" for method, runs in self.best.items())
        self.progress.advance(1, f"best so far: {means}")

    def on_trial_complete(self, iteration: int, trials: Any, trial: Any, **_: Any) -> None:  # noqa: ARG002
        """A run ended."""
        key = RunKey(**trial.config["run"])
        with self.parent.child(f"{key.method} {key.run}", {"method": key.method, "run": key.run}) as run:
            whole = recorded(key.path(self.job.folder))
            run.curves({name: [getattr(trial, name) for trial in whole] for name in ("f", "y", "best")})


def _submit(
    job: ComparisonJob, missing: Sequence[RunKey], total: int, settings: CompareSettings, run: Run
) -> None:
    os.environ["TUNE_DISABLE_SIGINT_HANDLER"] = "1"  # Ctrl-C is ours to handle
    os.environ["RAY_AIR_NEW_OUTPUT"] = "0"  # the new one prints whatever the verbosity
    storage = job.folder / ".ray-tune"
    left = sum(job.length - len(recorded(key.path(job.folder))) for key in missing)
    with ProgressLine("trials", total * job.length, total * job.length - left) as progress:
        tuner = Tuner(
            tune.with_resources(RunTrainable, {"cpu": 1}),
            param_space={
                "job": job,
                "run": tune.grid_search([{"method": key.method, "run": key.run} for key in missing]),
            },
            tune_config=TuneConfig(max_concurrent_trials=settings.slots, reuse_actors=True),
            run_config=RunConfig(
                name="runs",
                storage_path=str(storage),
                failure_config=FailureConfig(max_failures=_RUN_FAILURES),
                callbacks=[_Watch(job, progress, run)],
                verbose=0,
            ),
        )
        try:
            results = tuner.fit()
        finally:
            shutil.rmtree(storage, ignore_errors=True)
    if results.errors:
        raise UserError(
            f"{len(results.errors)} of {len(missing)} runs kept failing, the first with: "
            f"{str(results.errors[0]).strip().splitlines()[-1]}. "
            "The others are kept; the same command tries again"
        )


def _record(job: ComparisonJob, setup: Setup, run: Run) -> Summary:
    summary = summarise(rows(job.folder), Reporting(initial=job.initial), generator(0, "bootstrap", 0))
    table = write_table(job.folder, setup=job.setup, gap=job.gap)
    path = job.folder / "summary.json"
    path.write_text(json.dumps(summary.as_json(), indent=2) + "\n")
    seeds = len({key.run for key, _ in all_runs(job.folder)})
    title = f"{job.setup}: mean of {seeds} runs, 90 % intervals ({job.gap} gap)"
    drawn = figures.best_so_far(
        job.folder / "figure", summary, title=title, initial=job.initial, limits=setup.objective_limits
    )
    for figure in drawn:
        run.figure(figure)
    run.file(table)
    run.file(path)
    for name, method in summary.methods.items():
        run.curves({f"best/{name}": [estimate.mean for estimate in method.best]})
        best, broken = method.best[-1], method.broken_trials.mean
        say(
            f"{name:>18}: best after {summary.trials} trials {best.mean:+.2f} "
            f"[{best.low:+.2f}, {best.high:+.2f}], mean objective of its trials "
            f"{method.objective.mean:+.2f}, broken {broken:.0%}, {method.runs} runs"
        )
    say(f"{job.folder / 'figure.png'}; {run.url}")
    return summary
