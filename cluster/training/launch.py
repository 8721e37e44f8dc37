"""Hands a training job to Ray Train: what is heard of it meanwhile, what it survives, and what ends it."""

import shutil
import signal
import threading
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from ray.train import RunConfig, ScalingConfig, TrainingFailedError
from ray.train.torch import TorchTrainer
from ray.train.v2.api.config import FailureConfig

from cluster.config import TrainSettings
from cluster.errors import UsageError, UserError
from cluster.progress import ProgressLine, say
from cluster.runtime.mailbox import mailbox
from cluster.runtime.placement import FreeNode, Placement, place
from cluster.tracking import Run
from cluster.training.failures import DEATHS, explanation, is_death
from cluster.training.reports import Reports
from cluster.training.worker import TrainingJob, run_worker

PASSIVE_WAITING = {"OMP_WAIT_POLICY": "PASSIVE", "GOMP_SPINCOUNT": "0"}
"""Threads that wait for each other sleep: beside other work, spinning slows a training down many times."""
_STARTS = 2
"""Ray Train tries so many starts of the processes anew; each waits a minute for its room."""


def placement_of(settings: TrainSettings, machines: Sequence[FreeNode]) -> Placement:
    """Decide how many processes of which size train.

    Args:
        settings: of the training.
        machines: what is free.

    Returns:
        The placement; fewer processes than asked for will do where `least_workers` allows it.

    Raises:
        UserError: there is no room, or no GPU, with what is free and the remedy.
        UsageError: `least_workers` is larger than `workers`.
    """
    if settings.least_workers == "all":
        return place(settings.workers, settings.threads, machines, settings.device)
    if settings.least_workers > settings.workers:
        raise UsageError(
            f"train.least_workers must be at most train.workers, got {settings.least_workers} of "
            f"{settings.workers}; lower one with --set, or raise the other"
        )
    least = place(settings.least_workers, settings.threads, machines, settings.device)
    return replace(least, processes=settings.workers, least=settings.least_workers)


def submit(job: TrainingJob, placement: Placement, progress: ProgressLine, run: Run) -> None:
    """Train until the job's budget or time limit is spent.

    Args:
        job: what the training processes get.
        placement: how many of which size.
        progress: where updates are shown.
        run: of MLflow, which records the reports.

    Raises:
        UserError: training failed, or, once it has ended, the MLflow store still fails.
    """
    reports = Reports(progress, run)
    with mailbox(reports.receive) as box:
        try:
            _train(job, placement, box)
        except (KeyboardInterrupt, SystemExit):
            reports.give_up()
            raise
    reports.complete()


def _train(job: TrainingJob, placement: Placement, box: Any) -> None:
    """Tries again, from the last checkpoint, when processes die."""
    for deaths in range(DEATHS + 1):
        try:
            _fit(job, placement, box)
        except TrainingFailedError as error:
            if deaths == DEATHS or not is_death(error):
                raise UserError(explanation(error, job.model)) from error
            say(f"a training process died; going on from the last checkpoint ({deaths + 1} of {DEATHS})")
        else:
            return


def _fit(job: TrainingJob, placement: Placement, box: Any) -> None:
    storage = job.model / ".ray-train"
    trainer = TorchTrainer(
        run_worker,
        train_loop_config={"job": job, "threads": placement.cpus, "mailbox": box},
        scaling_config=ScalingConfig(
            num_workers=_workers(placement),
            use_gpu=placement.gpus > 0,
            resources_per_worker={"CPU": placement.cpus},
        ),
        run_config=RunConfig(
            name=uuid.uuid4().hex,
            storage_path=str(storage),
            failure_config=FailureConfig(max_failures=0, controller_failure_limit=_STARTS),
            worker_runtime_env={"env_vars": PASSIVE_WAITING},
        ),
    )
    try:
        with keep_interrupts():
            trainer.fit()
    finally:
        shutil.rmtree(storage, ignore_errors=True)


def _workers(placement: Placement) -> Any:
    """A pair of numbers makes Ray Train elastic, which its base class does not know."""
    return (placement.least, placement.processes) if placement.least else placement.processes


@contextmanager
def keep_interrupts() -> Iterator[None]:
    """Keeps the meaning of Ctrl-C in the main thread.

    Ray Train's handler for it exits, and stays for good. An exit here was that one or SIGTERM, which
    `terminating_as_exit` knows.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    interrupt = signal.getsignal(signal.SIGINT)
    try:
        yield
    except SystemExit:
        raise KeyboardInterrupt from None
    finally:
        signal.signal(signal.SIGINT, interrupt)
