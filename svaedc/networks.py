"""The networks of q(tau, psi|xi, y), p(tau, psi|x) and p(y|psi)."""

from collections.abc import Sequence
from itertools import pairwise
from typing import final

import torch
from jaxtyping import Float
from torch import Tensor, nn

from svaedc.architecture import KERNEL, STRIDE, ModelConfig, decoded_length, encoded_length
from svaedc.distributions import FAMILIES, Diagonal, bounded_scale, full_precision


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
        """Posterior of the latent code given normalised trajectories."""
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


PRIORS = {"mlp": MlpPrior, "deconv": DeconvPrior}
