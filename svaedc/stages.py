"""The two stages of training: the whole bound, then p(tau, psi|x) alone."""

import math
from abc import ABC, abstractmethod
from typing import Any, final

import numpy as np
import torch
from jaxtyping import Float, Integer
from torch import Tensor, nn

from svaedc.distributions import FAMILIES, Diagonal, kl_divergence
from svaedc.episodes import Batch, Episodes, measured_over
from svaedc.model import SvaeDc
from svaedc.settings import StageSettings, TrainingSettings


class Stage(ABC):
    """What one stage optimises.

    Attributes:
        name: `joint` or `prior`.
        settings: Budget and optimiser.
        module: What a distributed trainer wraps; all of it gets gradients.
        progress: Share of the stage that is done, kept up to date by the loop.
        memory: What an interrupted stage must remember beside the model and the optimiser.
    """

    name: str
    settings: StageSettings
    module: nn.Module

    def __init__(self) -> None:
        """Start at the stage's beginning."""
        self.progress = 0.0
        self.memory: dict[str, Any] = {"best_loss": math.inf, "stale": 0}

    @abstractmethod
    def loss(
        self, wrapped: nn.Module, positions: Integer[np.ndarray, " batch"]
    ) -> tuple[Float[Tensor, ""], dict[str, Float[Tensor, ""]]]:
        """Loss of the training episodes at `positions`, and the unweighted terms behind it.

        `wrapped` is `module`, possibly wrapped for distributed training.
        """

    @abstractmethod
    def held_out_loss(self, metrics: dict[str, float]) -> float:
        """What the stage minimises, on held-out episodes; `metrics` are the diagnostics of this epoch."""

    @property
    @abstractmethod
    def keeps_best(self) -> bool:
        """Whether the best epoch is the one to use, and not the last."""

    @property
    def is_stale(self) -> bool:
        """Whether the held-out loss has not become better for longer than the stage's patience."""
        return self.memory["stale"] >= self.settings.patience

    def end_epoch(self, metrics: dict[str, float]) -> float:
        """Remember this epoch if it is the best so far; returns the best held-out loss so far."""
        loss = self.held_out_loss(metrics)
        if loss < self.memory["best_loss"]:
            self._remember(loss)
        else:
            self.memory["stale"] += 1
        return self.memory["best_loss"]

    def finish(self) -> None:
        """Leave the model as it is to be used."""
        if self.keeps_best:
            self.module.load_state_dict(self.memory["best"])

    def _remember(self, loss: float) -> None:
        self.memory = {"best_loss": loss, "stale": 0}
        if self.keeps_best:
            best = {name: value.clone() for name, value in self.module.state_dict().items()}
            self.memory["best"] = best

    def begin_epoch(self) -> None:
        """Set training mode and this stage's dropout."""
        self.module.train()
        for layer in self.module.modules():
            if isinstance(layer, nn.Dropout):
                layer.p = self.settings.dropout


@final
class JointStage(Stage):
    """Stage one: log p(xi|tau) + w_y log p(y|psi) - w_kl KL(q || p(.|x)), all networks together."""

    name = "joint"

    def __init__(self, model: SvaeDc, training: Episodes, settings: TrainingSettings) -> None:
        """Train `model` on the `training` episodes."""
        super().__init__()
        self.module = model
        self.settings = settings.joint
        self._training = training
        self._weighting = settings.weighting
        self._elements = model.config.observation_dim * model.config.time_steps

    def loss(
        self, wrapped: nn.Module, positions: Integer[np.ndarray, " batch"]
    ) -> tuple[Float[Tensor, ""], dict[str, Float[Tensor, ""]]]:
        """Weighted negative bound per element of xi."""
        batch = self._training.gather(positions, next(wrapped.parameters()).device)
        log_p_xi, log_p_y, kl = (term.mean() for term in wrapped(*batch))
        weighted = log_p_xi + self._weighting.y * log_p_y - self._weighting.kl_at(self.progress) * kl
        terms = {"elbo": log_p_xi + log_p_y - kl, "log_p_xi": log_p_xi, "log_p_y": log_p_y, "kl": kl}
        return -weighted / self._elements, terms

    def held_out_loss(self, metrics: dict[str, float]) -> float:
        """Negative bound at its final weights, per element of xi."""
        weights = self._weighting
        weighted = metrics["log_p_xi"] + weights.y * metrics["log_p_y"] - weights.kl * metrics["kl"]
        return -weighted / self._elements

    @property
    def keeps_best(self) -> bool:
        """Only with early stopping: a decaying learning rate makes the last epoch the best one."""
        return math.isfinite(self.settings.patience)


@final
class PriorRefit(nn.Module):
    """KL(q || p(.|x)) as a function of p(tau, psi|x) only."""

    def __init__(self, model: SvaeDc) -> None:
        """Refit the prior of `model`."""
        super().__init__()
        self.network = model.prior_network

    def forward(self, x: Float[Tensor, "batch controller"], q: Diagonal) -> Float[Tensor, " batch"]:
        """KL term of each episode."""
        return kl_divergence(q, self.network(x))


@final
class PriorStage(Stage):
    """Stage two, a departure: p(tau, psi|x) goes on alone, regularised; its best held-out epoch is kept.

    Posteriors no longer change, so they are computed once.
    """

    name = "prior"

    def __init__(
        self, model: SvaeDc, training: Episodes, held_out: Episodes, settings: TrainingSettings
    ) -> None:
        """Refit the prior of `model` on the `training` episodes and select on the `held_out` ones."""
        super().__init__()
        self.module = PriorRefit(model)
        self.settings = settings.prior
        self._training = posteriors(model, training)
        self._held_out = posteriors(model, held_out)
        self._remember(self.held_out_loss({}))

    def loss(
        self, wrapped: nn.Module, positions: Integer[np.ndarray, " batch"]
    ) -> tuple[Float[Tensor, ""], dict[str, Float[Tensor, ""]]]:
        """Mean KL of the batch."""
        x, q = self._training
        rows = torch.from_numpy(positions).to(x.device)
        kl = wrapped(x[rows], type(q)(q.loc[rows], q.scale[rows])).mean()
        return kl, {"kl": kl}

    @torch.no_grad()
    def held_out_loss(self, metrics: dict[str, float]) -> float:  # noqa: ARG002 - all episodes, not a sample
        """KL(q || p(.|x)) of all held-out episodes."""
        self.module.eval()
        return float(self.module(*self._held_out).mean())

    @property
    def keeps_best(self) -> bool:
        """Always: this stage overfits, and what joint training left is its first candidate."""
        return True


def posteriors(model: SvaeDc, episodes: Episodes) -> tuple[Float[Tensor, "episodes controller"], Diagonal]:
    """Controllers and q(tau, psi|xi, y) of all episodes, in evaluation mode."""

    def encoded(batch: Batch) -> dict[str, Tensor]:
        q = model.posterior(batch.xi, batch.bad, batch.y)
        return {"x": batch.x, "loc": q.loc, "scale": q.scale}

    model.eval()
    found = measured_over(episodes, next(model.parameters()).device, encoded)
    return found["x"], FAMILIES[model.config.distribution](found["loc"], found["scale"])
