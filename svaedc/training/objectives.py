"""The two stages of training: the whole bound, then p(tau, psi|x) alone."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, final

import numpy as np
import torch
from jaxtyping import Float, Integer
from torch import Tensor, nn

from svaedc.data.episodes import Batch, Episodes, measure_batches
from svaedc.model.distributions import FAMILIES, Diagonal, kl_divergence
from svaedc.model.svae_dc import SvaeDc
from svaedc.training.config import StageSettings, TrainingSettings, Weighting

Terms = dict[str, Float[Tensor, ""]]
"""It holds means over a batch, unweighted, by name."""


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
    ) -> tuple[Float[Tensor, ""], Terms]:
        """Compute the loss of some training episodes.

        Args:
            wrapped: `module`, possibly wrapped for distributed training.
            positions: Of the training episodes, [batch].

        Returns:
            The loss, and the unweighted terms behind it.
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
class Objective(nn.Module):
    """The terms of stage one, all networks together."""

    def __init__(self, model: SvaeDc, weighting: Weighting) -> None:
        """Compute the terms of `model` that have a weight."""
        super().__init__()
        self.model = model
        self.generates = weighting.generation > 0.0

    def forward(self, batch: Batch) -> Terms:
        """Mean of each term over a batch."""
        log_p_xi, log_p_y, kl = (term.mean() for term in self.model(*batch))
        terms = {"elbo": log_p_xi + log_p_y - kl, "log_p_xi": log_p_xi, "log_p_y": log_p_y, "kl": kl}
        if self.generates:
            terms |= _from_x(self.model.generation_terms(self.model.prior(batch.x), batch.xi, batch.y))
        return terms


@final
class JointStage(Stage):
    """Stage one: log p(xi|tau) + w_y log p(y|psi) - w_kl KL(q || p(.|x)), and perhaps generation from x."""

    name = "joint"

    def __init__(self, model: SvaeDc, training: Episodes, settings: TrainingSettings) -> None:
        """Train `model` on the `training` episodes."""
        super().__init__()
        self.module = Objective(model, settings.weighting)
        self.settings = settings.joint
        self._training = training
        self._weighting = settings.weighting
        self._elements = model.config.observation_dim * model.config.time_steps

    def loss(
        self, wrapped: nn.Module, positions: Integer[np.ndarray, " batch"]
    ) -> tuple[Float[Tensor, ""], Terms]:
        """Compute the weighted negative bound per element of xi.

        Args:
            wrapped: `module`, possibly wrapped for distributed training.
            positions: Of the training episodes, [batch].

        Returns:
            The loss, and the unweighted terms behind it.
        """
        terms = wrapped(self._training.gather(positions, next(wrapped.parameters()).device))
        return self._loss_of(terms, self._weighting.kl_at(self.progress)), terms

    def held_out_loss(self, metrics: dict[str, float]) -> float:
        """The same at the weights of the stage's end."""
        return self._loss_of(metrics, self._weighting.kl)

    @property
    def keeps_best(self) -> bool:
        """Only with early stopping: a decaying learning rate makes the last epoch the best one."""
        return math.isfinite(self.settings.patience)

    def _loss_of(self, terms: Mapping[str, Any], kl_weight: float) -> Any:
        weights = self._weighting
        bound = terms["log_p_xi"] + weights.y * terms["log_p_y"] - kl_weight * terms["kl"]
        return -(bound + weights.from_x(terms)) / self._elements


@final
class PriorRefit(nn.Module):
    """The terms that p(tau, psi|x) appears in, as a function of it only."""

    def __init__(self, model: SvaeDc, weighting: Weighting) -> None:
        """Refit the prior of `model`."""
        super().__init__()
        self.network = model.prior_network
        self.generates = weighting.generation > 0.0
        # A function and no submodule: what it decodes with is not trained.
        self._generation_terms = model.generation_terms

    def forward(self, batch: Batch, q: Diagonal) -> Terms:
        """Average each term over a batch.

        Args:
            batch: Episodes.
            q: Their posteriors, row by row.

        Returns:
            Means by name.
        """
        p = self.network(batch.x)
        terms = {"kl": kl_divergence(q, p).mean()}
        return terms | _from_x(self._generation_terms(p, batch.xi, batch.y)) if self.generates else terms


@final
class PriorStage(Stage):
    """Stage two, a departure: p(tau, psi|x) goes on alone, regularised; its best held-out epoch is kept.

    Posteriors no longer change, so they are computed once.
    """

    name = "prior"

    def __init__(self, model: SvaeDc, training: Episodes, settings: TrainingSettings) -> None:
        """Refit the prior of `model` on the `training` episodes."""
        super().__init__()
        self.module = PriorRefit(model, settings.weighting)
        self.settings = settings.prior
        self._training = training
        self._posteriors = posteriors(model, training)
        self._weighting = settings.weighting
        self._frozen = [value for network in (model.decoder, model.badness) for value in _parameters(network)]
        for value in self._frozen:
            value.requires_grad = False

    def loss(
        self, wrapped: nn.Module, positions: Integer[np.ndarray, " batch"]
    ) -> tuple[Float[Tensor, ""], Terms]:
        """Compute the mean KL of the batch, and what generation adds to it.

        Args:
            wrapped: `module`, possibly wrapped for distributed training.
            positions: Of the training episodes, [batch].

        Returns:
            The loss, and the unweighted terms behind it.
        """
        ordered, q = np.sort(positions), self._posteriors
        batch = self._training.gather(ordered, q.loc.device)
        rows = torch.from_numpy(ordered).to(q.loc.device)
        terms = wrapped(batch, type(q)(q.loc[rows], q.scale[rows]))
        return self._loss_of(terms), terms

    def held_out_loss(self, metrics: dict[str, float]) -> float:
        """The same on held-out episodes."""
        return self._loss_of(metrics)

    @property
    def keeps_best(self) -> bool:
        """Always: this stage overfits, and what joint training left is its first candidate."""
        return True

    def finish(self) -> None:
        """Put the best epoch's network back."""
        super().finish()
        for value in self._frozen:
            value.requires_grad = True

    def _loss_of(self, terms: Mapping[str, Any]) -> Any:
        weights = self._weighting
        # Alone, the KL needs no weight, not even when it had none in stage one.
        return weights.kl * terms["kl"] - weights.from_x(terms) if weights.generation else terms["kl"]


def _from_x(found: tuple[Tensor, Tensor]) -> Terms:
    return {"log_p_xi_from_x": found[0].mean(), "log_p_y_from_x": found[1].mean()}


def _parameters(network: nn.Module | None) -> list[nn.Parameter]:
    return [] if network is None else list(network.parameters())


def posteriors(model: SvaeDc, episodes: Episodes) -> Diagonal:
    """Encode all episodes, in evaluation mode, in which the model stays.

    Args:
        model: Its device is used.
        episodes: At least one.

    Returns:
        q(tau, psi|xi, y) of each episode, in storage order, without gradients.
    """

    def encoded(batch: Batch) -> dict[str, Tensor]:
        q = model.posterior(batch.xi, batch.bad, batch.y)
        return {"loc": q.loc, "scale": q.scale}

    model.eval()
    found = measure_batches(episodes, next(model.parameters()).device, encoded)
    return FAMILIES[model.config.distribution](found["loc"], found["scale"])
