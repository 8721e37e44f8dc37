"""`svaedc compare`: plan methods x seeds, submit the runs to Ray Tune, gather their trials, record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cluster.comparison_folder import alone_in, claim
from cluster.comparison_job import ComparisonJob
from cluster.comparison_report import FIGURE, PAGE, SUMMARY, lines, publish, summary_of
from cluster.comparison_runs import Standing, Watch, submit
from cluster.comparison_tracking import Note, TrackedComparison, begin, note_in
from cluster.config import CompareSettings
from cluster.errors import UserError
from cluster.grid import Grid
from cluster.options import usage_errors
from cluster.progress import ProgressLine, say
from cluster.results import TABLE, RunKey, all_runs, recorded, seeds_in
from cluster.session import Session
from cluster.tracking import Run, Tracker
from cluster.trained_model import trained_model
from svaedc.comparison import Trial
from svaedc.summaries import Summary
from workers.dataset.shards import sha256
from workers.hardware import robots
from workers.physics import ranges
from workers.rollout import VERSION
from workers.setups import Setup


@dataclass(frozen=True)
class Comparison:
    """What a comparison ends with.

    Attributes:
        summary: of every run in its folder.
        url: of its MLflow run.
    """

    summary: Summary
    url: str


@dataclass(frozen=True)
class _Plan:
    job: ComparisonJob
    grid: Grid
    model: str  # its hash; "" when no method asked for needs one
    identity: Mapping[str, Any]
    slots: int
    caption: str
    trained_on: str  # the setup of the model's data where it is another one; "" elsewhere

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

    def missing(self, runs: Mapping[RunKey, Sequence[Trial]]) -> list[RunKey]:
        """The runs asked for that are not whole."""
        return [key for key in self.grid.keys() if len(runs.get(key, ())) < self.job.length]  # noqa: SIM118

    def require_length(self, runs: Mapping[RunKey, Sequence[Trial]]) -> None:
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
    caption: str = "",
) -> Comparison:
    """Run what is missing of a comparison, then summarise all of it.

    Args:
        setup: whose controllers are tried.
        grid: methods and seeds.
        trials: suggested in each run.
        gap: level of the hidden physics.
        model: folder of one trained on the setup, or on the one it stands in for.
        folder: of the results.
        settings: of the runs.
        session: where they run.
        tracker: that records them.
        caption: of figure and page, before what they say themselves.

    Raises:
        UsageError: a method or gap level does not exist, a gap's range is impossible, or a method lacks its
            model.
        UserError: the folder holds another comparison or cannot be written, the model is of another setup,
            runs kept failing, or MLflow lacks some of the results.
    """
    plan = _plan(setup, grid, trials, gap, model, folder, settings, caption)
    session.preflight(settings.slots)
    with alone_in(folder):
        grid.require_purpose(folder, seeds_in(folder))
        parameters = {**claim(folder, plan.identity, plan.model), **plan.parameters}
        note = note_in(folder, tracker)
        runs = dict(all_runs(folder))
        plan.require_length(runs)
        if _is_finished(plan, note, runs):
            say(f"{folder} holds the whole comparison: nothing to do")
            return Comparison(summary_of(plan.job, setup, list(runs.items())), Run(tracker, note.run).url)
        tracked = begin(folder, tracker, f"compare {setup.name}", parameters)
        with tracked.run:
            _submit(plan, tracked, runs)
            return Comparison(_record(plan, setup, tracked, parameters), tracked.run.url)


def _plan(
    setup: Setup,
    grid: Grid,
    trials: int,
    gap: str,
    model: Path | None,
    folder: Path,
    settings: CompareSettings,
    caption: str,
) -> _Plan:
    with usage_errors():
        setup.gap(gap)
    grid.require(model)
    path, trained_on = usable(model, setup) if grid.with_model() and model else (None, setup.name)
    level = str(ranges(gap)) if "=" in gap else gap  # so that equal ranges are one comparison
    job = ComparisonJob(
        folder=folder.resolve(),
        setup=setup.name,
        gap=level,
        model=str(path.resolve()) if path else "",
        pool_size=settings.pool_size,
        initial=settings.initial_trials,
        trials=trials,
    )
    identity = {
        "setup": setup.name,
        "gap": level,
        "pool_size": settings.pool_size,
        "initial_trials": settings.initial_trials,
        "rollout_version": VERSION,
    }
    return _Plan(
        job=job,
        grid=grid,
        model=sha256(path) if path else "",
        identity=identity,
        slots=settings.slots,
        caption=caption,
        trained_on=trained_on if trained_on != setup.name else "",
    )


def usable(model: Path, setup: Setup) -> tuple[Path, str]:
    """The checkpoint and the setup it was trained on: this one, or the one that it stands in for.

    Raises:
        UserError: it cannot be read, or was trained on another one.
    """
    found = trained_model(model, setup.name, robots.stands_in_for(setup.name))
    return found.path, str(found.metadata["setup"])


def _is_finished(plan: _Plan, note: Note, runs: Mapping[RunKey, Sequence[Trial]]) -> bool:
    """Whether all runs asked for are whole, and both the folder and MLflow have the results of all trials."""
    whole = not plan.missing(runs) and note.trials == sum(map(len, runs.values()))
    return whole and all((plan.job.folder / name).exists() for name in (TABLE, SUMMARY, FIGURE, PAGE))


def _submit(plan: _Plan, tracked: TrackedComparison, runs: Mapping[RunKey, Sequence[Trial]]) -> None:
    folder, keys, length = plan.job.folder, plan.grid.keys(), plan.job.length
    missing = plan.missing(runs)
    if not missing:
        return

    def ended(key: RunKey) -> None:
        trials = recorded(key.path(folder))
        if len(trials) >= length:
            tracked.try_child(key, trials)

    standing = Standing(plan.grid.methods, {key: runs[key][-1].best for key in keys if runs.get(key)})
    done = sum(min(len(runs.get(key, ())), length) for key in keys)
    with ProgressLine("trials", len(keys) * length, done) as progress:
        submit(plan.job, missing, plan.slots, Watch(progress, standing, ended))


def _record(plan: _Plan, setup: Setup, tracked: TrackedComparison, parameters: Mapping[str, Any]) -> Summary:
    runs = list(all_runs(plan.job.folder))
    summary = summary_of(plan.job, setup, runs)
    settings = {**parameters, "MLflow run": tracked.run.url}
    report = publish(plan.job, setup, runs, summary, settings, plan.caption)
    for line in lines(summary):
        say(line)
    say(f"{plan.job.folder / PAGE}; {tracked.run.url}")
    asked = set(plan.grid.keys())
    for key, trials in runs:
        if key in asked:
            tracked.child(key, trials)
    curves = {f"best/{name}": [best.mean for best in method.best] for name, method in summary.methods.items()}
    tracked.complete(report, curves, sum(len(trials) for _, trials in runs))
    return summary
