"""Latent features that the trials themselves may adjust: alpha, c and the last layers of the networks."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, cast, final

import gpytorch
import torch
from gpytorch.priors import NormalPrior
from jaxtyping import Float
from torch import Tensor, nn
from torch.func import functional_call

from svaedc.bo.features import LatentMeans, Sigmoid

LAST_LAYERS: Final = (
    "prior_network.latent.linear.weight",
    "prior_network.latent.linear.bias",
    "badness.output.weight",
    "badness.output.bias",
)
"""p(tau, psi|x) and p(y|psi) of an `SvaeDc` end with these parameters."""

SPREAD: Final = 0.1
"""A weight has this standard deviation around its trained value, in units of its layer's root mean square."""
SPREAD_OF_LOG_ALPHA: Final = 0.5
SPREAD_OF_C: Final = 0.1


@dataclass(frozen=True, eq=False)
class Adjustable:
    """A trained model whose last layers may be adjusted, in copies.

    Attributes:
        model: Has `latent_means`; it is never changed.
        layers: Names of the parameters that are adjusted.
    """

    model: nn.Module
    layers: Sequence[str] = LAST_LAYERS


@final
class AdjustedPaths(gpytorch.Module):
    r"""phi(x) = sigmoid(\alpha((1 - \bar y_x) - c)) \bar\tau_x, with alpha, c and the last layers to fit.

    Every adjusted number is its trained value plus a spread times a standard normal offset, which starts at
    0: maximising the marginal likelihood with this prior keeps near the trained model what the trials do not
    contradict (section 4 of the paper says what may be optimised, not how to keep it in bounds).

    Args:
        adjustable: The model.
        unit: Features are divided by this.
        start: alpha and c before any trial.
    """

    def __init__(self, adjustable: Adjustable, unit: float, start: Sigmoid) -> None:
        super().__init__()
        trained = dict(adjustable.model.named_parameters())
        self._trained = {f"model.{name}": trained[name].detach() for name in adjustable.layers}
        # In a tuple, the network is no submodule: nothing here can move, convert or train it.
        self._network = (_LatentMeans(adjustable.model),)
        self._unit = unit
        self._start = start
        self._offsets = {name: name.replace(".", "_") for name in self._trained}
        for name, value in self._trained.items():
            self._add_offset(self._offsets[name], torch.zeros_like(value))
        self._add_offset("log_alpha", torch.zeros(()))
        self._add_offset("c", torch.zeros(()))

    @property
    def compression(self) -> tuple[Tensor, Tensor]:
        """Slope alpha and midpoint c."""
        alpha = self._start.alpha * torch.exp(SPREAD_OF_LOG_ALPHA * self.offset_log_alpha)
        return alpha, self._start.c + SPREAD_OF_C * self.offset_c

    def forward(self, x: Float[Tensor, "*n D"]) -> Float[Tensor, "*n k"]:
        """The features of controllers."""
        tau, y = functional_call(self._network[0], self._layers(), (x.flatten(0, -2).float(),))
        alpha, c = self.compression
        phi = torch.sigmoid(alpha * ((1 - y.double().clamp(0, 1)) - c)).unsqueeze(-1) * tau.double()
        return phi.reshape(*x.shape[:-1], -1) / self._unit

    def _layers(self) -> dict[str, Tensor]:
        return {
            name: (value + SPREAD * value.square().mean().sqrt() * self._offset(name)).float()
            for name, value in self._trained.items()
        }

    def _offset(self, name: str) -> Tensor:
        offset: Tensor = getattr(self, f"offset_{self._offsets[name]}")
        return offset

    def _add_offset(self, name: str, start: Tensor) -> None:
        self.register_parameter(f"offset_{name}", nn.Parameter(start))
        self.register_prior(f"prior_of_{name}", NormalPrior(0.0, 1.0), f"offset_{name}")


class _LatentMeans(nn.Module):
    """The model's `latent_means` as the function of a module, which can be called with other weights."""

    def __init__(self, model: nn.Module) -> None:
        super().__init__()
        self.model = model

    def forward(self, x: Tensor) -> tuple[Tensor, Tensor]:
        return cast(LatentMeans, self.model.latent_means)(x)
