"""`svaedc train`: plan the job, submit it to Ray Train, gather its reports, record the model."""

import json
import shutil
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import ray
import torch
from ray.train import FailureConfig, RunConfig, ScalingConfig, TrainingFailedError
from ray.train.torch import TorchTrainer

from cluster import figures
from cluster.config import TrainSettings
from cluster.errors import UsageError, UserError
from cluster.mailbox import mailbox
from cluster.progress import ProgressLine, say
from cluster.session import Session
from cluster.tracking import Run, Tracker
from cluster.training_job import MODEL, STATE, TrainingJob, done, episodes, run_worker, saved_state
from svaedc import checkpoint, diagnostics
from workers.dataset.cache import TrainingCache
from workers.dataset.folder import Dataset, open_dataset

MINIMUM_EPISODES = 200
"""Fewer cannot be split into something to learn from and something to measure on."""
FULL_SIZE = 10_000
"""From here on a collapsed model is an error; below, it is expected often enough to be only reported."""
_WORKER_FAILURES = 3


def train(
    *,
    folder: Path,
    model: Path,
    preset: str,
    seed: int,
    settings: TrainSettings,
    session: Session,
    tracker: Tracker,
) -> Path:
    """Train a model on a dataset, or go on where an interrupted training stopped; returns the checkpoint.

    Raises:
        UserError: the dataset or an existing checkpoint does not fit, or a full-size training collapsed.
    """
    dataset = _dataset(folder)
    job = _plan(dataset, model, preset, seed, settings, session)
    if _finished(job):
        say(f"{model / MODEL} is already trained: nothing to do")
        return model / MODEL
    session.preflight(settings.workers * job.threads)
    cache = job.data()
    with _run(job, dataset, tracker, settings) as run:
        _submit(job, settings.workers, run)
        _record(job, cache, dataset, run)
    return model / MODEL


def _dataset(folder: Path) -> Dataset:
    try:
        dataset = open_dataset(folder)
    except ValueError as error:
        raise UserError(str(error)) from error
    if dataset.episodes() < MINIMUM_EPISODES:
        raise UserError(
            f"{folder} holds {dataset.episodes()} episodes, training needs at least {MINIMUM_EPISODES}: "
            "collect more with `svaedc collect`"
        )
    return dataset


def _plan(
    dataset: Dataset, model: Path, preset: str, seed: int, settings: TrainSettings, session: Session
) -> TrainingJob:
    model.mkdir(parents=True, exist_ok=True)
    identity = dataset.identity
    job = TrainingJob(
        dataset=dataset.folder.resolve(),
        model=model.resolve(),
        cache=settings.cache_folder,
        origin={
            "setup": identity.setup,
            "dataset": dataset.fingerprint(),
            "preset": preset,
            "stride": settings.stride,
            "seed": seed,
        },
        preset=preset,
        updates=0 if settings.updates == "preset" else settings.updates,
        stride=settings.stride,
        seed=seed,
        threads=settings.thread_count(session.cpus),
        time_limit=settings.time_limit_seconds,
        checkpoint_every=settings.checkpoint_every_epochs,
    )
    try:
        job.settings(job.data())
        saved_state(job)
    except LookupError as error:
        raise UsageError(error.args[0]) from error
    except (ValueError, OSError) as error:
        raise UserError(str(error)) from error
    return job


def _finished(job: TrainingJob) -> bool:
    path = job.model / MODEL
    if not path.exists():
        return False
    try:
        _, metadata = checkpoint.load(path)
        checkpoint.require(path, metadata, job.origin)
    except ValueError as error:
        raise UserError(str(error)) from error
    settings = job.settings(job.data()).training
    return bool(metadata["update"] == settings.joint.updates + settings.prior.updates)


@contextmanager
def _run(job: TrainingJob, dataset: Dataset, tracker: Tracker, settings: TrainSettings) -> Iterator[Run]:
    """The MLflow run of this model: the one it was started with, if training goes on."""
    memory = job.model / "run.json"
    if memory.exists() and (job.model / STATE).exists():
        started = tracker.resume(json.loads(memory.read_text())["run"])
    else:
        parameters = {**job.origin, **settings.model_dump(mode="json")}
        started = tracker.run(f"train {dataset.identity.setup}", "train", parameters)
        started.dataset(dataset.identity.setup, dataset.fingerprint(), dataset.folder)
    with started as run:
        memory.write_text(json.dumps({"run": run.id}) + "\n")
        yield run


def _submit(job: TrainingJob, workers: int, run: Run) -> None:
    storage = job.model / ".ray-train"
    with (
        ProgressLine("updates", _updates(job), _done(job)) as progress,
        mailbox(_receive(progress, run)) as box,
    ):
        trainer = TorchTrainer(
            run_worker,
            train_loop_config={"job": job, "mailbox": box},
            scaling_config=ScalingConfig(
                num_workers=workers, use_gpu=_has_gpus(), resources_per_worker={"CPU": job.threads}
            ),
            run_config=RunConfig(
                name=uuid.uuid4().hex,
                storage_path=str(storage),
                failure_config=FailureConfig(max_failures=_WORKER_FAILURES),
            ),
        )
        try:
            trainer.fit()
        except TrainingFailedError as error:
            raise UserError(f"training failed: {_first_failure(error)}") from error
        finally:
            shutil.rmtree(storage, ignore_errors=True)


def _first_failure(error: TrainingFailedError) -> str:
    failures = getattr(error, "worker_failures", {})
    return str(next(iter(failures.values()), error)).strip().splitlines()[-1]


def _updates(job: TrainingJob) -> int:
    settings = job.settings(job.data()).training
    return settings.joint.updates + settings.prior.updates


def _done(job: TrainingJob) -> int:
    state = saved_state(job)
    return 0 if state is None else done(state, job.settings(job.data()).training)


def _receive(progress: ProgressLine, run: Run) -> Any:
    def receive(report: dict[str, Any]) -> None:
        metrics = report["metrics"]
        note = (
            f"{report['stage']}, error against the median: reconstructed {metrics['held_out/rec_norm']:.2f}"
        )
        progress.advance(
            report["update"] - progress.done, f"{note}, generated {metrics['held_out/gen_norm']:.2f}"
        )
        run.metrics(metrics, step=report["update"])

    return receive


def _record(job: TrainingJob, cache: TrainingCache, dataset: Dataset, run: Run) -> None:
    model, metadata = checkpoint.load(job.model / MODEL)
    _, held_out = episodes(cache)
    metrics = diagnostics.evaluate(model, held_out)
    collapsed = diagnostics.collapse(metrics)
    figure = figures.reconstruction(job.model / "reconstruction.png", model, held_out, dataset.identity)
    summary = {"metrics": metrics, "collapsed": collapsed or "", "episodes": len(cache.episode), **metadata}
    (job.model / "metrics.json").write_text(json.dumps(summary, indent=2) + "\n")
    run.metrics({f"final/{name}": value for name, value in metrics.items()}, step=metadata["update"])
    run.figure(figure)
    run.file(job.model / MODEL)
    run.dict("model", summary)
    run.tags({"svaedc.collapsed": collapsed or "no", "svaedc.device": _device()})
    say(
        f"{job.model / MODEL}: held-out error against the per-step median {metrics['rec_norm']:.2f} "
        f"reconstructed, {metrics['gen_norm']:.2f} generated from x; correlation of y "
        f"{metrics['corr_y_rec']:.2f} and {metrics['corr_y_gen']:.2f}; {metrics['active_dimensions']:.0f} of "
        f"{model.config.tau_size} latent dimensions active; {run.url}"
    )
    _judge(collapsed, metadata["update"], _updates(job), len(cache.episode))


def _judge(collapsed: str | None, update: int, updates: int, count: int) -> None:
    if update < updates:
        say(f"stopped at the time limit after {update} of {updates} updates; the same command goes on")
    if collapsed and count >= FULL_SIZE:
        raise UserError(f"{collapsed}. The checkpoint is kept, but should not be used")
    if collapsed:
        say(f"note, with only {count} episodes: {collapsed}")


def _has_gpus() -> bool:
    return bool(ray.cluster_resources().get("GPU", 0))


def _device() -> str:
    return "cuda" if torch.cuda.is_available() else "cpu"
