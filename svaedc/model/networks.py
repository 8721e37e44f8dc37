"""The networks of q(tau, psi|xi, y), p(tau, psi|x) and p(y|psi)."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Final, final

import torch
from jaxtyping import Float
from torch import Tensor, nn

from svaedc.model.config import KERNEL, STRIDE, ModelConfig, decoded_length, encoded_length
from svaedc.model.distributions import FAMILIES, Diagonal, bounded_scale, full_precision
from svaedc.model.normalizer import TrainingStatistics


def convolutions(channels: Sequence[int]) -> nn.Sequential:
    """1D convolutions over time with ReLU between `channels[0]` inputs and `channels[-1]` outputs."""
    layers = [[nn.Conv1d(a, b, KERNEL, STRIDE), nn.ReLU()] for a, b in pairwise(channels)]
    return nn.Sequential(*(module for layer in layers for module in layer))


def transposed_convolutions(channels: Sequence[int]) -> nn.Sequential:
    """Transposed 1D convolutions over time with ReLU, the reverse of `convolutions`."""
    layers = [[nn.ConvTranspose1d(a, b, KERNEL, STRIDE), nn.ReLU()] for a, b in pairwise(channels)]
    return nn.Sequential(*(module for layer in layers for module in layer))


@final
class LatentHead(nn.Module):
    """Linear layer for the location and the scale of [tau, psi]; locations are not squashed."""

    def __init__(self, features: int, config: ModelConfig) -> None:
        """Build for `features` inputs."""
        super().__init__()
        self.linear = nn.Linear(features, 2 * config.latent_size)
        self.family = FAMILIES[config.distribution]
        self.bounds = config.latent_scale

    def forward(self, features: Float[Tensor, "batch features"]) -> Diagonal:
        """Distribution of the latent code, event `[latent]`."""
        loc, raw_scale = full_precision(self.linear(features)).chunk(2, dim=-1)
        return self.family(loc, bounded_scale(raw_scale, self.bounds.floor, self.bounds.cap))


@final
class Encoder(nn.Module):
    """q(tau, psi | xi, y): convolutions with observations as channels and time as the sequence (section 5).

    The per-step bad indicator is one more channel; y itself joins at the linear layer, because under a
    training stride it is no longer the mean of the indicators that are seen. The SVAE's q(tau | xi) sees
    neither.
    """

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        self.sees_badness = config.has_psi
        extra = int(config.has_psi)
        self.convolutions = convolutions((config.observation_dim + extra, *config.channels))
        length = encoded_length(config.time_steps, len(config.channels))
        self.latent = LatentHead(config.channels[-1] * length + extra, config)

    def forward(
        self,
        xi: Float[Tensor, "batch obs time"],
        bad: Float[Tensor, "batch time"],
        y: Float[Tensor, " batch"],
    ) -> Diagonal:
        """Encode trajectories.

        Args:
            xi: Trajectories as `posterior_input` says, normalised, [batch, obs, time].
            bad: 1 at each bad step, else 0, [batch, time]. The SVAE ignores it.
            y: Badness of each episode in [0, 1], [batch]. The SVAE ignores it.

        Returns:
            Posterior of the latent code, event `[latent]`.
        """
        if not self.sees_badness:
            return self.latent(self.convolutions(xi).flatten(1))
        features = self.convolutions(torch.cat([xi, bad.unsqueeze(1)], dim=1)).flatten(1)
        return self.latent(torch.cat([features, y.unsqueeze(1)], dim=1))


@final
class DeconvPrior(nn.Module):
    """p(tau, psi|x) of the paper: x as a sequence of length 1 through transposed convolutions."""

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        self.deconvolutions = transposed_convolutions((config.controller_dim, *config.prior_hidden))
        length = decoded_length(1, len(config.prior_hidden))
        self.dropout = nn.Dropout(0.0)
        self.latent = LatentHead(config.prior_hidden[-1] * length, config)

    def forward(self, x: Float[Tensor, "batch controller"]) -> Diagonal:
        """Distribution of the latent code of each controller."""
        return self.latent(self.dropout(self.deconvolutions(x.unsqueeze(-1)).flatten(1)))


@final
class MlpPrior(nn.Module):
    """p(tau, psi|x) as an MLP, a departure: transposed convolutions overfit and cost 2.7 times more."""

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        sizes = (config.controller_dim, *config.prior_hidden)
        layers = [[nn.Linear(a, b), nn.ReLU(), nn.Dropout(0.0)] for a, b in pairwise(sizes)]
        self.hidden = nn.Sequential(*(module for layer in layers for module in layer))
        self.latent = LatentHead(sizes[-1], config)

    def forward(self, x: Float[Tensor, "batch controller"]) -> Diagonal:
        """Distribution of the latent code of each controller."""
        return self.latent(self.hidden(2.0 * x - 1.0))


@final
class Badness(nn.Module):
    """p(y|psi): MLP with two hidden layers of 64 (section 5); its mean stays in (0, 1), as y does."""

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        sizes = (config.psi_size, *config.badness_hidden)
        layers = [[nn.Linear(a, b), nn.ReLU()] for a, b in pairwise(sizes)]
        self.hidden = nn.Sequential(*(module for layer in layers for module in layer))
        self.output = nn.Linear(sizes[-1], 2)
        self.family = FAMILIES[config.distribution]
        self.bounds = config.badness_scale

    def forward(self, psi: Float[Tensor, "batch psi"]) -> Diagonal:
        """Distribution of y, an event without dimensions."""
        raw_loc, raw_scale = full_precision(self.output(self.hidden(psi))).unbind(-1)
        return self.family(
            torch.sigmoid(raw_loc), bounded_scale(raw_scale, self.bounds.floor, self.bounds.cap)
        )


PlanOf = Callable[[Tensor], Tensor]
"""It gives the plans [batch, channels, steps] of controllers [batch, D], about -1 to 1; gradients reach x."""


@final
class PlanPrior(nn.Module):
    """p(tau, psi|x) that reads a controller's plan as a sequence, a departure: x hides what a plan shows.

    A convolution that halves the steps, recurrent layers (GRU), and one hidden layer over the last state, the
    mean and the largest values over time, and x; `prior_hidden` has their sizes in this order. What computes
    plans is code of the robot, and no part of the weights.
    """

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`; `plan_of` is to be set before use."""
        super().__init__()
        self.plan_of: PlanOf | None = None
        filters, *widths, hidden = config.prior_hidden
        self.convolution = nn.Conv1d(config.plan_channels, filters, 5, stride=2, padding=2)
        layers = pairwise((filters, *widths))
        self.recurrent = nn.ModuleList(nn.GRU(before, width, batch_first=True) for before, width in layers)
        self.summary = nn.Linear(3 * widths[-1] + config.controller_dim, hidden)
        self.dropouts = nn.ModuleList(nn.Dropout(0.0) for _ in range(2))
        self.latent = LatentHead(hidden, config)

    def forward(self, x: Float[Tensor, "batch controller"]) -> Diagonal:
        """Distribution of the latent code of each controller."""
        if self.plan_of is None:
            raise RuntimeError("this model reads plans: set plan_of to what computes those of its robot")
        states = torch.relu(self.convolution(self.plan_of(x))).swapaxes(1, 2)
        for layer in self.recurrent:
            states, _ = layer(states)
        seen = [states[:, -1], states.mean(dim=1), states.amax(dim=1), 2.0 * x - 1.0]
        before, after = self.dropouts
        return self.latent(after(torch.relu(self.summary(before(torch.cat(seen, dim=1))))))


PRIORS = {"mlp": MlpPrior, "deconv": DeconvPrior, "plan": PlanPrior}


@final
class DeconvTrunk(nn.Module):
    """The paper's reverse of the encoder: transposed convolutions over the latent path."""

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        self.path = (config.tau_dim, config.path_length)
        self.deconvolutions = transposed_convolutions((config.tau_dim, *reversed(config.channels)))
        self.features = config.channels[0] * decoded_length(config.path_length, len(config.channels))

    def forward(self, tau: Float[Tensor, "batch tau"]) -> Float[Tensor, "batch features"]:
        """Features of each flattened latent path."""
        return self.deconvolutions(tau.unflatten(1, self.path)).flatten(1)


@final
class MlpTrunk(nn.Module):
    """MLP over the flattened latent path, a departure: cheaper, and better at decoding means of p(tau|x)."""

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        sizes = (config.tau_size, *config.decoder_hidden)
        layers = [[nn.Linear(a, b), nn.ReLU()] for a, b in pairwise(sizes)]
        self.hidden = nn.Sequential(*(module for layer in layers for module in layer))
        self.features = sizes[-1]

    def forward(self, tau: Float[Tensor, "batch tau"]) -> Float[Tensor, "batch features"]:
        """Features of each flattened latent path."""
        return self.hidden(tau)


TRUNKS: Final[dict[str, type[DeconvTrunk] | type[MlpTrunk]]] = {"deconv": DeconvTrunk, "mlp": MlpTrunk}


@final
class DenseHead(nn.Module):
    """The paper's p(xi|tau): a dense layer from the trunk to location and scale of every element of xi."""

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        self.trunk = TRUNKS[config.trunk](config)
        self.shape = (2, config.observation_dim, config.time_steps)
        self.output = nn.Linear(self.trunk.features, 2 * config.observation_dim * config.time_steps)
        self.family = FAMILIES[config.distribution]
        self.bounds = config.observation_scale

    def adopt(self, statistics: TrainingStatistics) -> None:
        """Ignore the statistics: the paper's head starts from random weights."""

    def forward(self, tau: Float[Tensor, "batch tau"]) -> Diagonal:
        """Distribution of scaled trajectories, event `[obs, time]`."""
        output = full_precision(self.output(self.trunk(tau)))
        loc, raw_scale = output.unflatten(1, self.shape).unbind(1)
        return self.family(loc, bounded_scale(raw_scale, self.bounds.floor, self.bounds.cap))


@final
class LowRankHead(nn.Module):
    """p(xi|tau) as the per-step median plus coefficients times a learnt basis; a departure from the paper.

    The basis starts at the principal directions of the training residuals, which took the held-out
    reconstruction error from .74 (random basis) to .57 of the median's, with 1/20 of the dense head's
    weights.
    """

    median: Tensor
    spread: Tensor

    def __init__(self, config: ModelConfig) -> None:
        """Build from the sizes in `config`."""
        super().__init__()
        observations, steps = config.observation_dim, config.time_steps
        self.trunk = TRUNKS[config.trunk](config)
        self.coefficients = nn.Linear(self.trunk.features, config.rank)
        self.basis = nn.Parameter(0.1 * torch.randn(config.rank, observations, steps))
        self.raw_scale = nn.Linear(self.trunk.features, observations)
        self.raw_scale_per_step = nn.Parameter(torch.zeros(observations, steps))
        self.register_buffer("median", torch.full((observations, steps), 0.5))
        self.register_buffer("spread", torch.full((observations, 1), 0.25))
        self.family = FAMILIES[config.distribution]
        self.bounds = config.observation_scale

    def adopt(self, statistics: TrainingStatistics) -> None:
        """Start from the median trajectory and the principal directions around it."""
        with torch.no_grad():
            self.median.copy_(torch.from_numpy(statistics.median))
            self.spread.copy_(torch.from_numpy(statistics.spread).unsqueeze(1))
            self.basis.copy_(torch.from_numpy(statistics.directions))

    def forward(self, tau: Float[Tensor, "batch tau"]) -> Diagonal:
        """Distribution of scaled trajectories, event `[obs, time]`."""
        features = self.trunk(tau)
        product = full_precision(self.coefficients(features) @ self.basis.flatten(1))
        residual = product.view(-1, *self.median.shape)
        raw_scale = full_precision(self.raw_scale(features)).unsqueeze(-1) + self.raw_scale_per_step
        scale = self.spread * bounded_scale(raw_scale, self.bounds.floor, self.bounds.cap)
        return self.family(self.median + self.spread * residual, scale)


HEADS: Final[dict[str, type[DenseHead] | type[LowRankHead]]] = {"dense": DenseHead, "low-rank": LowRankHead}
