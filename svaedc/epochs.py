"""Epochs of one training stage: a fixed number of updates, measures on held-out episodes, and a state."""

import math
from collections.abc import Iterator
from copy import deepcopy
from dataclasses import dataclass
from typing import Any, Final, final

import numpy as np
import torch
from jaxtyping import Integer
from torch import Tensor, nn

from svaedc.diagnostics import evaluate
from svaedc.episodes import Episodes
from svaedc.model import SvaeDc
from svaedc.sampling import Order, batches
from svaedc.settings import TrainingSettings, optimiser_of
from svaedc.stages import JointStage, PriorStage, Stage
from svaedc.workplace import Workplace

TrainingState = dict[str, Any]
"""Plain values and tensors for `torch.save`; `torch.load(weights_only=True)` reads them back."""

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
class Run:
    """One training run: what its stages have in common."""

    model: SvaeDc
    training: Episodes
    held_out: Episodes
    settings: TrainingSettings
    order: Order
    workplace: Workplace

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

    def __init__(self, run: Run, stage: Stage, wrapped: nn.Module) -> None:
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
        if not done:
            self._stage.end_epoch(evaluate(self._run.model, self._measured_on))
        for epoch in range(done, -(-total // size)):
            updates = range(epoch * size, min((epoch + 1) * size, total))
            metrics = self._epoch(epoch, updates)
            held_out = evaluate(self._run.model, self._measured_on)
            best = self._stage.end_epoch(held_out)
            is_over = updates.stop == total or self._run.workplace.agree(self._stage.is_stale)
            if is_over:
                self._stage.finish()
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
            shard = run.workplace.shard
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
        for group in self._optimiser.param_groups:
            group["lr"] = settings.learning_rate_at(update)
        self._stage.progress = update / settings.updates
        with self._run.workplace.autocast(self._device):
            loss, terms = self._stage.loss(self._wrapped, positions)
        self._optimiser.zero_grad()
        loss.backward()
        nn.utils.clip_grad_norm_(self._stage.module.parameters(), settings.gradient_norm)
        self._optimiser.step()
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
                    "optimiser": self._optimiser.state_dict(),
                    "memory": stage.memory,
                }
            ),
        )


def require_settings(state: TrainingState, settings: TrainingSettings) -> None:
    """Refuse to go on from a state of other settings.

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
