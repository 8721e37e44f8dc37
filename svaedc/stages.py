"""The two stages of training: the whole bound, then p(tau, psi|x) alone."""

from abc import ABC, abstractmethod
from typing import Any, Final, final

import numpy as np
import torch
from jaxtyping import Float, Integer
from torch import Tensor, nn

from svaedc.distributions import Diagonal, kl_divergence
from svaedc.episodes import Episodes
from svaedc.model import SvaeDc
from svaedc.settings import StageSettings, TrainingSettings

_ENCODING_BATCH: Final = 256


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
        self.memory: dict[str, Any] = {}

    @abstractmethod
    def loss(
        self, wrapped: nn.Module, positions: Integer[np.ndarray, " batch"]
    ) -> tuple[Float[Tensor, ""], dict[str, Float[Tensor, ""]]]:
        """Loss of the training episodes at `positions`, and the unweighted terms behind it.

        `wrapped` is `module`, possibly wrapped for distributed training.
        """

    @abstractmethod
    def end_epoch(self) -> dict[str, float]:
        """Extra held-out measures after an epoch."""

    @abstractmethod
    def finish(self) -> None:
        """Leave the model as it is to be used."""

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

    def end_epoch(self) -> dict[str, float]:
        """Nothing beyond the usual diagnostics."""
        return {}

    def finish(self) -> None:
        """The last weights are the ones to use."""


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

    Posteriors no longer change, so they are computed once. Keeping the best epoch instead of stopping there
    means that no worker has to agree with another on when to stop.
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
        self._remember(self._held_out_kl())

    def loss(
        self, wrapped: nn.Module, positions: Integer[np.ndarray, " batch"]
    ) -> tuple[Float[Tensor, ""], dict[str, Float[Tensor, ""]]]:
        """Mean KL of the batch."""
        x, q = self._training
        rows = torch.from_numpy(positions).to(x.device)
        kl = wrapped(x[rows], type(q)(q.loc[rows], q.scale[rows])).mean()
        return kl, {"kl": kl}

    def end_epoch(self) -> dict[str, float]:
        """Keep this epoch's network if it is the best so far."""
        kl = self._held_out_kl()
        if kl < self.memory["best_kl"]:
            self._remember(kl)
        return {"best_kl": self.memory["best_kl"]}

    def finish(self) -> None:
        """Put the best epoch's network back."""
        self.module.load_state_dict(self.memory["best"])

    def _remember(self, kl: float) -> None:
        best = {name: value.clone() for name, value in self.module.state_dict().items()}
        self.memory = {"best": best, "best_kl": kl}

    @torch.no_grad()
    def _held_out_kl(self) -> float:
        self.module.eval()
        return float(self.module(*self._held_out).mean())


@torch.no_grad()
def posteriors(model: SvaeDc, episodes: Episodes) -> tuple[Float[Tensor, "episodes controller"], Diagonal]:
    """Controllers and q(tau, psi|xi, y) of all episodes, in evaluation mode."""
    device = next(model.parameters()).device
    model.eval()
    controllers, locs, scales = [], [], []
    for start in range(0, len(episodes), _ENCODING_BATCH):
        positions = np.arange(start, min(start + _ENCODING_BATCH, len(episodes)))
        batch = episodes.gather(positions, device)
        q = model.posterior(batch.xi, batch.bad, batch.y)
        controllers.append(batch.x)
        locs.append(q.loc)
        scales.append(q.scale)
    return torch.cat(controllers), type(q)(torch.cat(locs), torch.cat(scales))
