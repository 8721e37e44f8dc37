"""`svaedc train`: plan the job, submit it to Ray Train, record the model."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cluster.config import TrainSettings
from cluster.errors import UsageError, UserError
from cluster.files import alone_in, read_json, write_json
from cluster.progress import ProgressLine, say
from cluster.runtime.placement import Placement, free_machines
from cluster.runtime.session import Session
from cluster.tracking import Run, Tracker
from cluster.training.launch import placement_of, submit
from cluster.training.record import judge, read_record, record
from cluster.training.worker import MODEL, STATE, TrainingJob, saved_state, updates_in
from svaedc.model import checkpoint
from svaedc.training.config import TrainingSettings
from svaedc.training.loop import require_settings
from svaedc.training.presets import usual_stride
from workers.dataset.cache import TrainingCache
from workers.dataset.folder import Dataset, open_dataset
from workers.dataset.notes import notes
from workers.dataset.storage.location import Location
from workers.dataset.storage.s3_connection import StoreError

MINIMUM_EPISODES = 200
"""Fewer cannot be split into something to learn from and something to measure on."""
RUN = "run.json"


@dataclass(frozen=True)
class _Plan:
    """A job that was checked against its data and its folder.

    Attributes:
        job: what the training processes get.
        dataset: that it trains on.
        cache: of the dataset.
        done: updates behind the folder's last checkpoint.
        updates: of the whole training.
    """

    job: TrainingJob
    dataset: Dataset
    cache: TrainingCache
    done: int
    updates: int


def train(
    *,
    folder: Location,
    model: Path,
    preset: str,
    seed: int,
    settings: TrainSettings,
    session: Session,
    tracker: Tracker,
) -> Path:
    """Train a model on a dataset, or go on where an interrupted training stopped.

    Args:
        folder: of the dataset.
        model: folder of the model.
        preset: of model and training.
        seed: of weights, order and draws.
        settings: of the training.
        session: where it runs.
        tracker: that records it.

    Returns:
        Path of the checkpoint.

    Raises:
        UserError: the dataset, an existing checkpoint, the disk or the cluster does not fit, another command
            trains into the folder, or a full-size training collapsed.
        UsageError: there is no such preset, or the model's folder is a file.
    """
    with _refusals(model):
        dataset = trainable(folder)
        with working_in(model):
            job = plan_job(dataset, model, preset, seed, settings)
            if not (model / MODEL).exists():
                # Before the data is decoded, which may take an hour.
                placement_of(settings, free_machines(session))
            plan = _check(job, dataset)
            summary = _summary(plan, settings, session, tracker)
    judge(summary, plan.updates)
    return model / MODEL


def _summary(plan: _Plan, settings: TrainSettings, session: Session, tracker: Tracker) -> dict[str, Any]:
    """What is recorded of the model; whatever is missing of it is made."""
    model, trained = plan.job.model, _trained_updates(plan)
    summary = read_record(model, plan.updates) if trained == plan.updates else None
    if summary is not None:
        say(f"{model / MODEL} is already trained: nothing to do")
        return summary
    for note in notes(plan.dataset):
        say(f"note: {note}")
    placement = placement_of(settings, free_machines(session)) if trained < plan.updates else None
    with _run(plan, tracker, settings) as run:
        if placement is not None:
            _submit(plan, placement, run)
        return record(plan.job, plan.cache, plan.dataset, run, settings.moments)


@contextmanager
def _refusals(model: Path) -> Iterator[None]:
    """Turns what the cores and the disk refuse into errors for the user."""
    try:
        yield
    except LookupError as error:
        raise UsageError(error.args[0]) from error
    except StoreError as error:
        raise UserError(str(error)) from error
    except OSError as error:
        raise UserError(
            f"cannot train into {model}: {error}; make room or make it writable and run the same command: "
            "it goes on from there"
        ) from error
    except ValueError as error:
        raise UserError(str(error)) from error


def trainable(folder: Location) -> Dataset:
    """The dataset of a folder.

    Raises:
        UserError: it is too small.
        ValueError: there is none.
    """
    dataset = open_dataset(folder)
    if dataset.episodes() < MINIMUM_EPISODES:
        raise UserError(
            f"{folder} holds {dataset.episodes()} episodes, training needs at least {MINIMUM_EPISODES}: "
            "collect more with `svaedc collect`"
        )
    return dataset


@contextmanager
def working_in(model: Path) -> Iterator[None]:
    """Makes the folder of a model, and keeps other trainings out of it for as long as the block lasts.

    Raises:
        UsageError: it is a file.
        UserError: another command trains into it.
    """
    try:
        model.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError) as error:
        raise UsageError(
            f"--model takes a folder, {error.filename or model} is a file: name another folder"
        ) from error
    refusal = f"another training is at work in {model}; wait for its end, or name another --model folder"
    with alone_in(model, refusal):
        yield


def plan_job(dataset: Dataset, model: Path, preset: str, seed: int, settings: TrainSettings) -> TrainingJob:
    """Gather what the training processes get.

    Args:
        dataset: to train on.
        model: folder of the model.
        preset: of model and training.
        seed: of weights, order and draws.
        settings: of the training.

    Returns:
        The job, with absolute paths.
    """
    stride = settings.stride_or(usual_stride(preset))
    return TrainingJob(
        dataset=dataset.folder.resolve(),
        model=model.resolve(),
        # Training processes have another working directory.
        cache=settings.cache_folder.resolve(),
        origin={
            "setup": dataset.identity.setup,
            "dataset": dataset.fingerprint(),
            "preset": preset,
            "stride": stride,
            "seed": seed,
            "balance": settings.balance,
            "changes": settings.changes(),
        },
        preset=preset,
        updates=0 if settings.updates == "preset" else settings.updates,
        stride=stride,
        seed=seed,
        time_limit=settings.time_limit_seconds,
        checkpoint_every=settings.checkpoint_every_epochs,
        changes=settings.changes(),
        balance=settings.balance,
        precision=settings.precision,
    )


def _check(job: TrainingJob, dataset: Dataset) -> _Plan:
    """Refuses here whatever every training process would refuse, one after the other."""
    cache = job.data()
    training = job.settings(cache).training
    return _Plan(
        job, dataset, cache, updates_so_far(job, training), training.joint.updates + training.prior.updates
    )


def updates_so_far(job: TrainingJob, training: TrainingSettings) -> int:
    """Count the updates behind the checkpoint from which a job goes on.

    Args:
        job: what the training processes get.
        training: settings that the checkpoint must have.

    Returns:
        Updates of both stages; 0 without a checkpoint.

    Raises:
        UserError: it was made with other settings.
        ValueError: it is damaged or of another origin.
    """
    state = saved_state(job)
    if state is None:
        return 0
    try:
        require_settings(state, training)
    except ValueError as error:
        raise UserError(f"{job.model / STATE}: {error}, in another --model folder") from error
    return updates_in(state, training)


def _trained_updates(plan: _Plan) -> int:
    """Updates behind the folder's model; 0 without one."""
    path = plan.job.model / MODEL
    if not path.exists():
        return 0
    _, metadata = checkpoint.load(path)
    checkpoint.require(path, metadata, plan.job.origin)
    if metadata["update"] != plan.updates and not (plan.job.model / STATE).exists():
        raise UserError(
            f"{path} was trained for {metadata['update']} updates, not {plan.updates}, and its {STATE} is "
            "gone, so nothing can go on from it; train into another --model folder"
        )
    return int(metadata["update"])


@contextmanager
def _run(plan: _Plan, tracker: Tracker, settings: TrainSettings) -> Iterator[Run]:
    """The MLflow run of this model: the one it was started with, if training goes on and the store has it."""
    job, identity = plan.job, plan.dataset.identity
    earlier = str(read_json(job.model / RUN).get("run", ""))
    is_begun = (job.model / STATE).exists() or (job.model / MODEL).exists()
    if earlier and is_begun and tracker.holds(earlier):
        started = tracker.resume(earlier)
    else:
        # The origin has numbers where settings may say `preset`.
        parameters = {**settings.model_dump(mode="json"), **job.origin}
        started = tracker.run(f"train {identity.setup}", "train", parameters)
        started.dataset(identity.setup, job.origin["dataset"], plan.dataset.folder)
    with started as run:
        write_json(job.model / RUN, {"run": run.id})
        yield run


def _submit(plan: _Plan, placement: Placement, run: Run) -> None:
    say(f"training with {placement}")
    with ProgressLine("updates", plan.updates, plan.done) as progress:
        submit(plan.job, placement, progress, run)
