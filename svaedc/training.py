"""The training loop as a generator of epoch reports: the core yields, the shell logs and saves."""

import math
from collections.abc import Callable, Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import torch
from jaxtyping import Integer
from torch import Tensor, nn

from svaedc.diagnostics import evaluate
from svaedc.episodes import Episodes
from svaedc.model import SvaeDc
from svaedc.sampling import ALONE, Shard, batches
from svaedc.settings import TrainingSettings, optimiser_of
from svaedc.stages import JointStage, PriorStage, Stage

TrainingState = dict[str, Any]
"""Plain values and tensors for `torch.save`; `torch.load(weights_only=True)` reads them back."""

STAGES: Final = ("joint", "prior")


@dataclass(frozen=True)
class EpochReport:
    """What one epoch did.

    Attributes:
        stage: `joint` or `prior`.
        epoch: Epochs of this stage that are done.
        update: Updates of all stages that are done.
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


def _unchanged(module: nn.Module) -> nn.Module:
    return module


def fit(
    model: SvaeDc,
    training: Episodes,
    held_out: Episodes,
    settings: TrainingSettings,
    resume: TrainingState | None = None,
    shard: Shard = ALONE,
    parallelise: Callable[[nn.Module], nn.Module] = _unchanged,
) -> Iterator[EpochReport]:
    """Train `model` in place, on the device of its parameters, and report after every epoch.

    Randomness is a function of (seed, stage, epoch, rank) alone, and torch's own generator is left as it was,
    so an interrupted run that resumes ends with the same bits as one that was not.

    Args:
        model: From `initialised`.
        training: All workers' training episodes; `shard` selects this worker's.
        held_out: Measured after every epoch; they also select stage two's network.
        settings: The run.
        resume: `EpochReport.state` of an earlier run with the same settings, or None for a new run. A
            finished run yields nothing more.
        shard: This worker among those that train together.
        parallelise: Wraps what each stage optimises, for example in DistributedDataParallel.

    Raises:
        ValueError: `resume` comes from other settings, or there are too few episodes.
        FloatingPointError: The loss is no longer finite.
    """
    run = _Run(model, training, held_out, settings, shard)
    position = _Position("joint", 0) if resume is None else run.load(resume)
    for name in STAGES[STAGES.index(position.stage) :]:
        done = position.epoch if name == position.stage else 0
        if done * settings.epoch_updates >= run.budget(name):
            continue
        stage = run.stage(name)
        loop = _Loop(run, stage, parallelise(stage.module))
        if resume is not None and done:
            loop.load(resume)
        yield from loop.epochs(done)


@dataclass(frozen=True)
class _Position:
    """Where training stands: epochs done in a stage."""

    stage: str
    epoch: int


@dataclass(frozen=True)
class _Run:
    """The arguments of `fit` that every stage needs."""

    model: SvaeDc
    training: Episodes
    held_out: Episodes
    settings: TrainingSettings
    shard: Shard

    def load(self, state: TrainingState) -> _Position:
        """Put saved weights into the model."""
        if state["settings"] != self.settings.to_dict():
            raise ValueError(
                "training can only resume with its own settings, but "
                f"{_difference(state['settings'], self.settings)}; start a new run to change them"
            )
        self.model.load_state_dict(state["model"])
        return _Position(state["stage"], state["epoch"])

    def budget(self, stage: str) -> int:
        """Updates of a stage."""
        return {"joint": self.settings.joint, "prior": self.settings.prior}[stage].updates

    def stage(self, name: str) -> Stage:
        """Stage by name, built on the model as it is now."""
        if name == "joint":
            return JointStage(self.model, self.training, self.settings)
        return PriorStage(self.model, self.training, self.held_out, self.settings)


class _Loop:
    """One stage's optimiser and its epochs."""

    def __init__(self, run: _Run, stage: Stage, wrapped: nn.Module) -> None:
        """Optimise `stage` through `wrapped`."""
        self._run, self._stage, self._wrapped = run, stage, wrapped
        self._optimiser = optimiser_of(stage.module, stage.settings)
        self._device = next(stage.module.parameters()).device
        rng = np.random.default_rng(run.settings.seed)
        self._measured_on = run.held_out.sample(run.settings.held_out_sample, rng)

    def load(self, state: TrainingState) -> None:
        """Go on from a saved state of this stage."""
        self._optimiser.load_state_dict(state["optimiser"])
        self._stage.memory = state["memory"]

    def epochs(self, done: int) -> Iterator[EpochReport]:
        """Epochs of the stage that are left, each a fixed number of updates."""
        size, total = self._run.settings.epoch_updates, self._stage.settings.updates
        for epoch in range(done, -(-total // size)):
            updates = range(epoch * size, min((epoch + 1) * size, total))
            metrics = self._epoch(epoch, updates)
            extra = self._stage.end_epoch()
            if updates.stop == total:
                self._stage.finish()
            yield self._report(epoch + 1, updates.stop, metrics, extra)

    def _epoch(self, epoch: int, updates: range) -> dict[str, float]:
        """Means of the training terms over the epoch's updates."""
        run = self._run
        seed = (run.settings.seed, STAGES.index(self._stage.name))
        devices = [self._device] if self._device.type == "cuda" else []
        self._stage.begin_epoch()
        sums: dict[str, Tensor] = {}
        with torch.random.fork_rng(devices=devices):
            entropy = np.random.SeedSequence((*seed, epoch, run.shard.rank))
            torch.manual_seed(int(entropy.generate_state(1)[0]))
            order = batches(len(run.training), run.settings.batch_size, run.shard, seed, updates)
            for update, positions in zip(updates, order, strict=True):
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
        for group in self._optimiser.param_groups:
            group["lr"] = settings.learning_rate_at(update)
        self._stage.progress = update / settings.updates
        loss, terms = self._stage.loss(self._wrapped, positions)
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._stage.module.parameters(), settings.gradient_norm)
        self._optimiser.step()
        return {"loss": loss.detach()} | {name: value.detach() for name, value in terms.items()}

    def _report(
        self, epoch: int, done: int, metrics: dict[str, float], extra: dict[str, float]
    ) -> EpochReport:
        run, stage = self._run, self._stage
        held_out = evaluate(run.model, self._measured_on) | extra
        earlier = sum(run.budget(name) for name in STAGES[: STAGES.index(stage.name)])
        return EpochReport(
            stage=stage.name,
            epoch=epoch,
            update=earlier + done,
            updates=sum(run.budget(name) for name in STAGES),
            metrics=metrics | {f"held_out/{name}": value for name, value in held_out.items()},
            state=deepcopy(
                {
                    "stage": stage.name,
                    "epoch": epoch,
                    "settings": run.settings.to_dict(),
                    "model": run.model.state_dict(),
                    "optimiser": self._optimiser.state_dict(),
                    "memory": stage.memory,
                }
            ),
        )


def _difference(saved: dict[str, Any], settings: TrainingSettings) -> str:
    """First setting that differs, with both values."""
    current = settings.to_dict()
    name = next(name for name in sorted(current) if saved.get(name) != current[name])
    return f"{name} was {saved.get(name)}, is {current[name]}"
