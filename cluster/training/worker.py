"""What one training process does: load, resume, run the core's loop, keep its state on disk, send word."""

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
import ray.train
import torch
from ray.train.collective import broadcast_from_rank_zero
from ray.train.torch import get_device, prepare_model

from cluster.optimization.models import let_read_plans
from svaedc.data.episodes import Episodes, split
from svaedc.data.samplers import Balanced, Order, WorkerRank, uniform
from svaedc.model import checkpoint
from svaedc.model.svae_dc import SvaeDc, initialized_model
from svaedc.training.config import TrainingSettings
from svaedc.training.distributed import SINGLE_PROCESS, DistributedContext
from svaedc.training.loop import EpochReport, fit
from svaedc.training.presets import Preset, Sizes, preset, vary
from workers.dataset.cache import TrainingCache, training_cache
from workers.dataset.folder import open_dataset
from workers.dataset.storage.location import Location
from workers.setups import load

MODEL = checkpoint.FILE
STATE = "training.pt"


@dataclass(frozen=True)
class TrainingJob:
    """Everything a training process needs, as plain values.

    Attributes:
        dataset: its folder.
        model: the folder of the model.
        cache: where caches are kept.
        origin: what the model is made from; a checkpoint of another origin is refused.
        preset: its name.
        updates: gradient updates of each stage; 0 for the preset's own number.
        stride: control steps between two samples.
        seed: of weights, order and draws.
        time_limit: seconds after which training stops at the end of an epoch.
        checkpoint_every: epochs between two checkpoints.
        changes: of the preset, by name.
        balance: quantity whose strata are shown equally often: `y`, `f` or `none`.
        precision: `auto`, `float32` or `bfloat16`.
    """

    dataset: Location
    model: Path
    cache: Path
    origin: dict[str, Any]
    preset: str
    updates: int
    stride: int
    seed: int
    time_limit: float
    checkpoint_every: int
    changes: dict[str, Any] = field(default_factory=dict)
    balance: str = "none"
    precision: str = "float32"

    def __post_init__(self) -> None:
        """Refuse paths that mean something else in another process."""
        for name in ("dataset", "model", "cache"):
            if not getattr(self, name).is_absolute():
                raise ValueError(f"{name} must be an absolute path, got {getattr(self, name)}; resolve it")

    def data(self) -> TrainingCache:
        """The training cache, decoded on this machine if it is not there yet.

        Raises:
            ValueError: the dataset is no longer the one that the job was planned for.
        """
        dataset = open_dataset(self.dataset)
        cache = training_cache(dataset, self.stride, self.cache)
        # Afterwards, because it may have grown meanwhile; shards never change, so now equal means equal then.
        fingerprint = dataset.fingerprint()
        if fingerprint != self.origin["dataset"]:
            raise ValueError(
                f"{self.dataset} has changed since this training was planned: its fingerprint was "
                f"{self.origin['dataset'][:12]}, is {fingerprint[:12]}; let its collection end, then train "
                "into another folder"
            )
        return cache

    def settings(self, cache: TrainingCache) -> Preset:
        """The preset for this data, with the job's seed and budget."""
        planned = planned_channels(self.origin["setup"])
        sizes = Sizes(cache.x.shape[1], cache.xi.shape[1], cache.xi.shape[2], planned)
        made = vary(preset(self.preset)(sizes), self.changes)
        training = replace(made.training, seed=self.seed)
        if self.updates:
            training = training.with_updates(self.updates, self.updates if training.prior.updates else 0)
        return Preset(made.model, training)

    def order(self, cache: TrainingCache) -> Order:
        """How the training episodes follow each other."""
        if self.balance == "none":
            return uniform
        quantity = {"y": cache.y, "f": cache.f}[self.balance]
        return Balanced(np.asarray(quantity[cache.training()]))


def planned_channels(setup: str) -> int:
    """How many channels the plans of a setup's controllers have; 0 where they offer none."""
    return len(load(setup).controller.planned)


def episodes(cache: TrainingCache) -> tuple[Episodes, Episodes]:
    """Training and held-out episodes of a cache."""
    rows = np.arange(len(cache.episode))
    return split(Episodes(cache.x, cache.xi, cache.bad, cache.y, rows), cache.held_out())


def bounds(dataset: Location) -> tuple[list[float], list[float]]:
    """Lower and upper bounds of the dataset's observation channels."""
    channels = open_dataset(dataset).identity.observation
    return [channel[2] for channel in channels], [channel[3] for channel in channels]


def run_worker(config: dict[str, Any]) -> None:
    """Train as one of Ray Train's workers.

    Args:
        config: the `job`, the `threads` of torch and the `mailbox` for reports.
    """
    torch.set_num_threads(config["threads"])
    # Nobody waits for the driver: a report is sent, and training goes on.
    train_together(config["job"], config["mailbox"].actor.put_nowait.remote)


def train_together(job: TrainingJob, send: Callable[[dict[str, Any]], object]) -> SvaeDc:
    """Train one model together with all other workers; rank 0 saves it and reports.

    Args:
        job: what is trained, from which data.
        send: takes every report.

    Returns:
        This worker's copy of the model.
    """
    device = get_device()
    context = _context(job, device)
    return _train(job, context, device, send, lambda update: ray.train.report({"update": update}))


def train_alone(job: TrainingJob) -> SvaeDc:
    """The model, trained in this process without Ray Train; it goes on from a saved state all the same."""
    return _train(job, SINGLE_PROCESS, torch.device("cpu"), lambda _: None, lambda _: None)


def _train(
    job: TrainingJob,
    context: DistributedContext,
    device: torch.device,
    tell: Callable[[dict[str, Any]], object],
    end_epoch: Callable[[int], object],
) -> SvaeDc:
    begin = time.monotonic()
    is_first = context.shard.rank == 0
    cache = job.data()
    training, held_out = episodes(cache)
    settings = job.settings(cache)
    model = initialized_model(settings.model, training, bounds(job.dataset), job.seed).to(device)
    let_read_plans(model, job.origin["setup"])
    state = saved_state(job)
    update = 0 if state is None else updates_in(state, settings.training)
    if is_first:
        tell({"device": f"{_device_name(device)}, {context.precision}"})
    mark, size = time.monotonic(), settings.training.batch_size
    for report in fit(model, training, held_out, settings.training, state, job.order(cache), context):
        late = context.agree(time.monotonic() - begin > job.time_limit)
        if is_first:
            if late or report.is_last or report.epoch % job.checkpoint_every == 0:
                checkpoint.write(job.model / STATE, {"origin": job.origin, "state": report.state})
            tell(_message(report, (report.update - update) * size / (time.monotonic() - mark)))
        update, mark = report.update, time.monotonic()
        end_epoch(update)
        if late:
            break
    if is_first:
        metadata = {**job.origin, "update": update, "versions": _versions()}
        checkpoint.save(job.model / MODEL, model, metadata)
    return model


def updates_in(state: dict[str, Any], settings: TrainingSettings) -> int:
    """Count the updates behind a saved state.

    Args:
        state: as `saved_state` returns it.
        settings: of the training.

    Returns:
        Updates of both stages.
    """
    before = settings.joint.updates if state["stage"] == "prior" else 0
    stage = settings.prior if state["stage"] == "prior" else settings.joint
    is_over = state["is_over"]
    return before + (stage.updates if is_over else state["epoch"] * settings.epoch_updates)


def saved_state(job: TrainingJob) -> dict[str, Any] | None:
    """The state to continue from, if there is one.

    Raises:
        ValueError: when the folder's checkpoint is damaged or of another origin.
    """
    path = job.model / STATE
    if not path.exists():
        return None
    content = checkpoint.read(path)
    checkpoint.require(path, content["origin"], job.origin)
    return content["state"]


def _context(job: TrainingJob, device: torch.device) -> DistributedContext:
    """This process among those of Ray Train."""
    context = ray.train.get_context()
    precision = job.precision
    if precision == "auto":
        has_bfloat16 = device.type == "cuda" and torch.cuda.is_bf16_supported(including_emulation=False)
        precision = "bfloat16" if has_bfloat16 else "float32"
    return DistributedContext(
        WorkerRank(context.get_world_rank(), context.get_world_size()),
        prepare_model,
        broadcast_from_rank_zero,
        precision,
    )


def _device_name(device: torch.device) -> str:
    if device.type == "cuda":
        return f"{device} ({torch.cuda.get_device_name(device)})"
    return f"{device} ({torch.get_num_threads()} threads)"


def _message(report: EpochReport, rate: float) -> dict[str, Any]:
    names = ("stage", "update", "updates")
    metrics = {**report.metrics, "train/trajectories_per_second": rate}
    return {**{name: getattr(report, name) for name in names}, "metrics": metrics}


def _versions() -> dict[str, str]:
    return {name: version(name) for name in ("svaedc", "torch", "numpy")}
