"""`svaedc train --sweep`: train around a preset on Ray Tune, and tell which model is better for BO."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from ray import tune
from ray.tune import RunConfig, TuneConfig, Tuner

from cluster.config import TrainSettings
from cluster.errors import UsageError, UserError
from cluster.files import replacing
from cluster.progress import say, timing
from cluster.runtime.session import Session
from cluster.runtime.tune import silence_tune
from cluster.tracking import Run, Tracker
from cluster.training.sweep_worker import METHODS, RUNS, TRIALS, SweepPoint, run_point
from cluster.training.train import plan_job, trainable, updates_so_far, working_in
from svaedc.training.presets import usual_stride
from workers.dataset.folder import Dataset
from workers.dataset.storage.location import Location

TABLE: Final = "sweep.md"
MINIMUM_EPISODES: Final = 500
"""A tenth is held out, of which screening leaves a third for the trials of a run."""
CHANGES: Final[Mapping[str, Mapping[str, Any]]] = {
    "preset": {},
    "kl-0.3": {"kl_weight": 0.3},
    "kl-3": {"kl_weight": 3.0},
    "rate-3e-4": {"learning_rate": 3e-4},
    "rate-3e-3": {"learning_rate": 3e-3},
    "dense": {"head": "dense"},
    "stride-10": {"stride": 10},
    "bound-alone": {"weighting": "paper"},
}
"""One change is made at a time: of what matters most, a step to each side."""


def sweep(
    *,
    folder: Location,
    model: Path,
    preset: str,
    seed: int,
    settings: TrainSettings,
    session: Session,
    tracker: Tracker,
    changes: Mapping[str, Mapping[str, Any]] = CHANGES,
) -> Path:
    """Train a model for each change and rank them by a cheap proxy of what they are worth for BO.

    What is finished is kept: the same command goes on with the rest.

    Args:
        folder: of the dataset.
        model: folder, in which each model has its own.
        preset: of model and training.
        seed: of weights, order and draws.
        settings: of the trainings, before a change.
        session: where they run.
        tracker: that records them.
        changes: other values of settings, by the name of the model.

    Returns:
        Path of the table, best model first.

    Raises:
        UserError: the dataset, an existing folder or the cluster does not fit, another command trains into
            the folder, or points kept failing.
        UsageError: a setting asks for what a sweep does not do.
    """
    require_one_cpu(settings)
    session.preflight(1)
    dataset = _swept(folder)
    with working_in(model):
        points = _plan(dataset, model, preset, seed, settings, changes)
        missing = [point for point in points if not point.result]
        say(f"{len(points)} models, {len(points) - len(missing)} of them trained already")
        own = {"preset": preset, "seed": seed, "stride": settings.stride_or(usual_stride(preset))}
        with tracker.run(f"sweep {preset}", "sweep", {**settings.model_dump(mode="json"), **own}) as run:
            if missing:
                with timing(f"training {len(missing)} models, {session.cpus} at a time"):
                    _submit(missing, session.cpus)
            return _record(points, model, run)


def require_one_cpu(settings: TrainSettings) -> None:
    """Refuse settings of a training that a sweep would not follow.

    Raises:
        UsageError: naming the setting and the remedy.
    """
    followed: dict[str, tuple[object, ...]] = {
        "workers": (1,),
        "least_workers": ("all", 1),
        "threads": ("all", 1),
        "device": ("auto", "cpu"),
        "precision": ("auto", "float32"),
    }
    for name, values in followed.items():
        if getattr(settings, name) not in values:
            raise UsageError(
                f"a sweep trains each model on one CPU in float32, train.{name} asks for "
                f"{getattr(settings, name)}: leave it out, or train without --sweep"
            )


@contextmanager
def _refusals() -> Iterator[None]:
    """Turns what the cores and the disk refuse into errors for the user."""
    try:
        yield
    except (ValueError, LookupError, OSError) as error:
        raise UserError(f"cannot sweep: {error}") from error


def _swept(folder: Location) -> Dataset:
    with _refusals():
        dataset = trainable(folder)
        if dataset.episodes() < MINIMUM_EPISODES:
            raise ValueError(
                f"{folder} holds {dataset.episodes()} episodes, a sweep needs at least {MINIMUM_EPISODES}: "
                "collect more with `svaedc collect`"
            )
        return dataset


def _plan(
    dataset: Dataset,
    model: Path,
    preset: str,
    seed: int,
    settings: TrainSettings,
    changes: Mapping[str, Mapping[str, Any]],
) -> list[SweepPoint]:
    """Jobs whose folders fit, and whose caches exist, so that none decodes what another decodes too."""
    points = []
    with _refusals():
        for name, change in changes.items():
            varied = settings.model_copy(update={**change})
            job = plan_job(dataset, model / "sweep" / name, preset, seed, varied)
            training = job.settings(job.data()).training
            points.append(SweepPoint(name, job, training.joint.updates + training.prior.updates))
            if not points[-1].result:
                updates_so_far(job, training)
    return points


def _submit(missing: Sequence[SweepPoint], slots: int) -> None:
    silence_tune()
    with tempfile.TemporaryDirectory(prefix="svaedc-tune-") as storage:
        results = Tuner(
            tune.with_resources(run_point, {"cpu": 1}),
            param_space={"point": tune.grid_search(list(missing))},
            tune_config=TuneConfig(max_concurrent_trials=slots),
            run_config=RunConfig(name="sweep", storage_path=storage, verbose=0),
        ).fit()
    if results.errors:
        reason = str(results.errors[0]).strip().splitlines()[-1]
        raise UserError(
            f"{len(results.errors)} of {len(missing)} models failed, the first with: {reason}. "
            "The others are kept, and the same command tries these again"
        )
    unfinished = [point for point in missing if not point.result]
    if unfinished:
        raise UserError(
            f"{len(unfinished)} of {len(missing)} models were stopped by train.time_limit_seconds before "
            "their end, and nothing is ranked without them; the same command goes on with them"
        )


def _record(points: Sequence[SweepPoint], model: Path, run: Run) -> Path:
    results = sorted((point.result for point in points), key=lambda each: -each["svae-dc"]["best"])
    path = model / TABLE
    with replacing(path) as unfinished:
        unfinished.write_text("\n".join(_table(results)) + "\n", encoding="utf-8")
    for result in results:
        with run.child(result["name"], {"point": result["name"]}) as child:
            child.metrics(_numbers(result), step=0)
    run.file(path)
    table = path.read_text(encoding="utf-8")
    say(f"{table}\nbest for BO by this proxy: {results[0]['name']}; {path}; {run.link}")
    return path


def _table(results: Sequence[Mapping[str, Any]]) -> list[str]:
    """Markdown, best first."""
    head = [
        "model",
        *(f"{method}: best after {TRIALS}" for method in METHODS),
        *("svae-dc: mean", "generated", "reconstructed", "y from x", "active", "bound"),
    ]
    rows = [
        (
            each["name"],
            *(f"{each[method]['best']:.3f}" for method in METHODS),
            f"{each['svae-dc']['mean']:.3f}",
            *(f"{each['metrics'][name]:.3f}" for name in ("gen_norm", "rec_norm", "corr_y_gen")),
            *(f"{each['metrics'][name]:.0f}" for name in ("active_dimensions", "elbo")),
        )
        for each in results
    ]
    lines = [head, ["---"] * len(head), *rows]
    note = f"Means over {RUNS} runs on recorded held-out episodes, which nothing was trained on; best first."
    return [note, "", *("| " + " | ".join(line) + " |" for line in lines)]


def _numbers(result: Mapping[str, Any]) -> dict[str, float]:
    worths = {f"{method}/{name}": value for method in METHODS for name, value in result[method].items()}
    return {**result["metrics"], **worths}
