"""How a model is trained: budgets, optimisers and the weights of the bound."""

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import torch
from torch import nn


@dataclass(frozen=True)
class Weighting:
    """Weights of the bound's terms during training; the unweighted bound is always reported too.

    Attributes:
        kl: Weight of the KL term; 1 is the paper's equation.
        y: Weight of log p(y|psi); 1 is the paper's equation.
        warm_up: Share of the joint stage over which the KL weight rises linearly from 0.
        generation: Weight of log p(xi|tau) + y log p(y|psi) at the means of p(tau, psi|x); 0 is the paper's
            equation. The bound alone asks of p(tau, psi|x) to be near q, and not that its mean decodes to
            what the controller does, which is what generation and kernels use. A departure: the hybrid
            objective of Sohn, Lee and Yan (2015).
    """

    kl: float
    y: float
    warm_up: float
    generation: float = 0.0

    def __post_init__(self) -> None:
        """Refuse weights that leave nothing to maximise."""
        for name in ("kl", "y", "generation"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"weights must be finite and at least 0, got {name}={getattr(self, name)}")
        if not 0.0 <= self.warm_up <= 1.0:
            raise ValueError(f"warm_up is a share of the updates in [0, 1], got {self.warm_up}")

    def from_x(self, terms: Mapping[str, Any]) -> Any:
        """Weighted sum of the generation terms, as numbers or tensors; 0 without a weight."""
        if not self.generation:
            return 0.0
        return self.generation * (terms["log_p_xi_from_x"] + self.y * terms["log_p_y_from_x"])

    def kl_at(self, progress: float) -> float:
        """KL weight after `progress`, the share of the joint stage that is done."""
        return self.kl * min(1.0, progress / self.warm_up) if self.warm_up else self.kl


WEIGHTINGS: Final = {
    "paper": Weighting(kl=1.0, y=1.0, warm_up=0.1),
    "hybrid": Weighting(kl=1.0, y=1.0, warm_up=0.1, generation=1.0),
    "balanced": Weighting(kl=1.0, y=100.0, warm_up=0.3, generation=1.0),
}
"""`paper` is the paper's equation. In `hybrid`, generation from x counts as much as reconstruction.
`balanced` does that, and keeps psi alive where y drowns in the elements of xi."""


@dataclass(frozen=True)
class StageSettings:
    """One stage of training.

    Attributes:
        updates: Gradient updates; 0 leaves the stage out.
        optimiser: `adam` (decoupled weight decay) or `rmsprop` (alpha 0.99).
        schedule: `cosine` decay to 0 at the stage's end, or `halving` every 5,000 updates down to 1e-5
            (section 5).
        learning_rate: Of the first update.
        weight_decay: Of the optimiser.
        dropout: Between the hidden layers of p(tau, psi|x).
        gradient_norm: Gradients are scaled down to at most this norm.
        patience: Epochs without a better held-out loss after which the stage ends and puts its best epoch
            back; infinite for a stage that uses up its budget.
    """

    updates: int
    optimiser: str
    schedule: str
    learning_rate: float
    weight_decay: float
    dropout: float
    gradient_norm: float
    patience: float = math.inf

    def __post_init__(self) -> None:
        """Refuse unknown names and values outside their ranges."""
        for name, allowed in (("optimiser", OPTIMIZERS), ("schedule", SCHEDULES)):
            if getattr(self, name) not in allowed:
                raise ValueError(f"{name} must be one of {', '.join(allowed)}, got {getattr(self, name)!r}")
        if self.updates < 0 or self.learning_rate <= 0.0 or self.weight_decay < 0.0:
            raise ValueError(
                "updates and weight_decay must be at least 0 and learning_rate above it, got "
                f"{self.updates}, {self.weight_decay} and {self.learning_rate}"
            )
        if not (0.0 <= self.dropout < 1.0 and self.gradient_norm > 0.0 and self.patience >= 1.0):
            raise ValueError(
                "dropout must be in [0, 1), gradient_norm above 0 and patience at least 1, got "
                f"{self.dropout}, {self.gradient_norm} and {self.patience}"
            )

    def learning_rate_at(self, update: int) -> float:
        """Learning rate of update number `update`, counted from 0."""
        return SCHEDULES[self.schedule](self, update)


@dataclass(frozen=True)
class TrainingSettings:
    """Everything but data and sizes that determines a training run.

    Attributes:
        joint: Stage one: the whole bound.
        prior: Stage two: p(tau, psi|x) alone, refitted on the same KL term.
        weighting: Weights of stage one.
        batch_size: Episodes per update, over all workers together.
        epoch_updates: Updates between two reports (and two checkpoints): an epoch here, whatever the
            dataset's size.
        held_out_sample: Held-out episodes that each report is measured on.
        seed: Determines weights, order of episodes and every random draw.
    """

    joint: StageSettings
    prior: StageSettings
    weighting: Weighting
    batch_size: int
    epoch_updates: int = 250
    held_out_sample: int = 512
    seed: int = 0

    def __post_init__(self) -> None:
        """Refuse counts below their minimum."""
        for name, least in (("batch_size", 1), ("epoch_updates", 1), ("held_out_sample", 2), ("seed", 0)):
            if getattr(self, name) < least:
                raise ValueError(f"{name} must be at least {least}, got {getattr(self, name)}")

    def with_updates(self, joint: int, prior: int) -> "TrainingSettings":
        """Change the budgets alone; `cosine` ends with them, `halving` goes by updates alone.

        Args:
            joint: Updates of stage one.
            prior: Updates of stage two; 0 leaves it out.

        Returns:
            New settings; these stay as they are.
        """
        return replace(
            self, joint=replace(self.joint, updates=joint), prior=replace(self.prior, updates=prior)
        )

    def to_dict(self) -> dict[str, Any]:
        """Plain built-in values, for checkpoints and logs."""
        return asdict(self)


def optimizer_of(module: nn.Module, settings: StageSettings) -> torch.optim.Optimizer:
    """Make the optimiser of a stage.

    Args:
        module: What it optimises.
        settings: Name, learning rate and weight decay.

    Returns:
        A new optimiser over all parameters of `module`.
    """
    return OPTIMIZERS[settings.optimiser](module, settings)


def _adam(module: nn.Module, settings: StageSettings) -> torch.optim.Optimizer:
    return torch.optim.AdamW(module.parameters(), settings.learning_rate, weight_decay=settings.weight_decay)


def _rmsprop(module: nn.Module, settings: StageSettings) -> torch.optim.Optimizer:
    decay = settings.weight_decay
    return torch.optim.RMSprop(module.parameters(), settings.learning_rate, alpha=0.99, weight_decay=decay)


def _cosine(settings: StageSettings, update: int) -> float:
    return settings.learning_rate * 0.5 * (1.0 + math.cos(math.pi * update / settings.updates))


def _halving(settings: StageSettings, update: int) -> float:
    return max(settings.learning_rate * 0.5 ** (update // 5_000), min(1e-5, settings.learning_rate))


OPTIMIZERS: Final = {"adam": _adam, "rmsprop": _rmsprop}
SCHEDULES: Final = {"cosine": _cosine, "halving": _halving}
