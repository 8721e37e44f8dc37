"""Training as a generator of epoch reports: the core yields, the shell logs and saves."""

import math
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Final, final

import numpy as np
import torch
from jaxtyping import Integer
from torch import Tensor, nn

from svaedc.data.episodes import Episodes
from svaedc.data.samplers import Order, batches, uniform
from svaedc.model.diagnostics import evaluate
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.config import TrainingSettings, optimizer_of
from svaedc.training.distributed import SINGLE_PROCESS, DistributedContext
from svaedc.training.objectives import JointStage, PriorStage, Stage

TrainingState = dict[str, Any]
"""It holds plain values and tensors for `torch.save`; `torch.load(weights_only=True)` reads them back."""

STAGES: Final = ("joint", "prior")


@dataclass(frozen=True)
class EpochReport:
    """What one epoch did.

    Attributes:
        stage: `joint` or `prior`.
        epoch: Epochs of this stage that are done.
        update: Updates of all stages that are done, those counted in that a stage left out by stopping early.
        updates: Updates of all stages together.
        metrics: `train/...` means over the epoch and `held_out/...` diagnostics.
        state: From here training continues as if never interrupted; a copy, so it may be kept.
    """

    stage: str
    epoch: int
    update: int
    updates: int
    metrics: dict[str, float]
    state: TrainingState

    @property
    def is_last(self) -> bool:
        """Whether training is done."""
        return self.update == self.updates


@dataclass(frozen=True)
class TrainingRun:
    """One training run: what its stages have in common."""

    model: SvaeDc
    training: Episodes
    held_out: Episodes
    settings: TrainingSettings
    order: Order
    context: DistributedContext

    def load(self, state: TrainingState) -> None:
        """Put saved weights into the model."""
        require_settings(state, self.settings)
        self.model.load_state_dict(state["model"])

    def budget(self, stage: str) -> int:
        """Updates of a stage."""
        return {"joint": self.settings.joint, "prior": self.settings.prior}[stage].updates

    def stage(self, name: str) -> Stage:
        """Stage by name, built on the model as it is now."""
        if name == "joint":
            return JointStage(self.model, self.training, self.settings)
        return PriorStage(self.model, self.training, self.settings)


@final
class Loop:
    """One stage's optimiser and its epochs."""

    def __init__(self, run: TrainingRun, stage: Stage, wrapped: nn.Module) -> None:
        """Optimise `stage` through `wrapped`."""
        self._run, self._stage, self._wrapped = run, stage, wrapped
        self._optimizer = optimizer_of(stage.module, stage.settings)
        self._device = next(stage.module.parameters()).device
        rng = np.random.default_rng(run.settings.seed)
        self._measured_on = run.held_out.sample(run.settings.held_out_sample, rng)

    def load(self, state: TrainingState) -> None:
        """Go on from a saved state of this stage."""
        self._optimizer.load_state_dict(state["optimiser"])
        self._stage.memory = state["memory"]

    def epochs(self, done: int) -> Iterator[EpochReport]:
        """Epochs of the stage that are left, each a fixed number of updates."""
        size, total = self._run.settings.epoch_updates, self._stage.settings.updates
        if not done and self._stage.keeps_best:
            self._stage.end_epoch(evaluate(self._run.model, self._measured_on))
        for epoch in range(done, -(-total // size)):
            updates = range(epoch * size, min((epoch + 1) * size, total))
            metrics = self._epoch(epoch, updates)
            held_out = evaluate(self._run.model, self._measured_on)
            best = self._stage.end_epoch(held_out)
            is_over = updates.stop == total or self._run.context.agree(self._stage.is_stale)
            if is_over:
                self._stage.finish()
            if is_over and self._stage.keeps_best:
                held_out = evaluate(self._run.model, self._measured_on)
            metrics |= {f"held_out/{name}": value for name, value in held_out.items()}
            metrics["held_out/best_loss"] = best
            yield self._report(epoch + 1, total if is_over else updates.stop, metrics)
            if is_over:
                return

    def _epoch(self, epoch: int, updates: range) -> dict[str, float]:
        """Means of the training terms over the epoch's updates."""
        run = self._run
        seed = (run.settings.seed, STAGES.index(self._stage.name))
        devices = [self._device] if self._device.type == "cuda" else []
        self._stage.begin_epoch()
        sums: dict[str, Tensor] = {}
        with torch.random.fork_rng(devices=devices):
            shard = run.context.shard
            entropy = np.random.SeedSequence((*seed, epoch, shard.rank))
            torch.manual_seed(int(entropy.generate_state(1)[0]))
            size = run.settings.batch_size
            shares = batches(len(run.training), size, shard, seed, updates, run.order)
            for update, positions in zip(updates, shares, strict=True):
                for name, value in self._update(update, positions).items():
                    sums[name] = sums.get(name, torch.zeros_like(value)) + value
        means = {f"train/{name}": float(total) / len(updates) for name, total in sums.items()}
        if not all(math.isfinite(value) for value in means.values()):
            raise FloatingPointError(
                f"the loss is not finite after update {updates.stop} of stage {self._stage.name}: {means}; "
                "lower the learning rate, or check the dataset for diverged episodes"
            )
        return means | {"train/learning_rate": self._stage.settings.learning_rate_at(updates[-1])}

    def _update(self, update: int, positions: Integer[np.ndarray, " batch"]) -> dict[str, Tensor]:
        settings = self._stage.settings
        for group in self._optimizer.param_groups:
            group["lr"] = settings.learning_rate_at(update)
        self._stage.progress = update / settings.updates
        with self._run.context.autocast(self._device):
            loss, terms = self._stage.loss(self._wrapped, positions)
        self._optimizer.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._stage.module.parameters(), settings.gradient_norm)
        self._optimizer.step()
        return {"loss": loss.detach()} | {name: value.detach() for name, value in terms.items()}

    def _report(self, epoch: int, done: int, metrics: dict[str, float]) -> EpochReport:
        run, stage = self._run, self._stage
        earlier = sum(run.budget(name) for name in STAGES[: STAGES.index(stage.name)])
        return EpochReport(
            stage=stage.name,
            epoch=epoch,
            update=earlier + done,
            updates=sum(run.budget(name) for name in STAGES),
            metrics=metrics,
            state=deepcopy(
                {
                    "stage": stage.name,
                    "epoch": epoch,
                    "is_over": done == stage.settings.updates,
                    "settings": run.settings.to_dict(),
                    "model": run.model.state_dict(),
                    "optimiser": self._optimizer.state_dict(),
                    "memory": stage.memory,
                }
            ),
        )


def require_settings(state: TrainingState, settings: TrainingSettings) -> None:
    """Refuse to go on from a state of other settings.

    Args:
        state: `EpochReport.state` of an earlier run.
        settings: Those to go on with.

    Raises:
        ValueError: A setting differs; it is named with both values.
    """
    saved, current = _flat(state["settings"]), _flat(settings.to_dict())
    for name, value in current.items():
        if saved.get(name) != value:
            raise ValueError(
                f"training can only resume with its own settings, but {name} was {saved.get(name)}, "
                f"is {value}; start a new run to change it"
            )


def _flat(settings: dict[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested settings under dotted names."""
    flat: dict[str, Any] = {}
    for name, value in settings.items():
        flat |= _flat(value, f"{prefix}{name}.") if isinstance(value, dict) else {f"{prefix}{name}": value}
    return flat


def fit(
    model: SvaeDc,
    training: Episodes,
    held_out: Episodes,
    settings: TrainingSettings,
    resume: TrainingState | None = None,
    order: Order = uniform,
    context: DistributedContext = SINGLE_PROCESS,
) -> Iterator[EpochReport]:
    """Train `model` in place, on the device of its parameters, and report after every epoch.

    Randomness is a function of (seed, stage, epoch, rank) alone, and torch's own generator is left as it was,
    so an interrupted run that resumes ends with the same bits as one that was not.

    Args:
        model: From `initialized_model`.
        training: All workers' training episodes; the context's shard selects this worker's.
        held_out: Measured after every epoch; they also select stage two's network.
        settings: The run.
        resume: `EpochReport.state` of an earlier run with the same settings, or None for a new run. A
            finished run yields nothing more.
        order: Of the training episodes in each pass.
        context: Who trains with this process, and in which precision.

    Yields:
        A report after each epoch that is left.

    Raises:
        ValueError: `resume` comes from other settings, or there are too few episodes.
        FloatingPointError: The loss is no longer finite.
    """
    run = TrainingRun(model, training, held_out, settings, order, context)
    if resume is not None:
        run.load(resume)
    for name in _stages_left(settings, resume):
        stage = run.stage(name)
        loop = Loop(run, stage, context.parallelize(stage.module))
        done = 0
        if resume is not None and resume["stage"] == name:
            loop.load(resume)
            done = resume["epoch"]
        yield from loop.epochs(done)


def _stages_left(settings: TrainingSettings, resume: TrainingState | None) -> list[str]:
    """Stages with a budget that are not over, in order."""
    first = 0
    if resume is not None:
        first = STAGES.index(resume["stage"]) + int(resume["is_over"])
    return [name for name in STAGES[first:] if getattr(settings, name).updates]
