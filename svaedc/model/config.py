"""Sizes and choices of the SVAE-DC networks, as one value that validates itself."""

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, Final

KERNEL: Final = 4
"""Every convolution is so wide (paper, section 5)."""

STRIDE: Final = 2
"""Every convolution has this stride (paper, section 5)."""

_CHOICES: Final = {
    "distribution": ("laplace", "gaussian"),
    "head": ("low-rank", "dense"),
    "trunk": ("mlp", "deconv"),
    "prior": ("mlp", "deconv", "plan"),
    "posterior_input": ("residual", "scaled"),
}
_SIZES: Final = (
    "controller_dim",
    "observation_dim",
    "time_steps",
    "path_length",
    "tau_dim",
    "rank",
)


@dataclass(frozen=True)
class ScaleBounds:
    """Smooth lower and upper end of a predicted scale, in the unit of what it scales."""

    floor: float
    cap: float

    def __post_init__(self) -> None:
        """Refuse an empty, negative or infinite range."""
        if not 0.0 < self.floor < self.cap < math.inf:
            raise ValueError(f"scale bounds must satisfy 0 < floor < cap, got {self.floor} and {self.cap}")


@dataclass(frozen=True)
class ModelConfig:
    """Everything that determines the shapes of an `SvaeDc`.

    Attributes:
        controller_dim: D, dimensions of x.
        observation_dim: Channels of a trajectory.
        time_steps: Steps S of a (strided) trajectory.
        path_length: K, steps of the latent path.
        tau_dim: Dimensions of tau at each step of the path.
        psi_dim: Dimensions of psi at each step of the path; 0 makes it the SVAE of equation (elbo_simple),
            which knows nothing of badness.
        distribution: Family of all four networks, `laplace` (the paper) or `gaussian`.
        head: Output of p(xi|tau): `dense` (the paper) or `low-rank` (ours).
        trunk: Hidden layers of p(xi|tau): `deconv` (the paper) or `mlp` (ours).
        prior: p(tau, psi|x): `deconv` (the paper), `mlp` (ours), or `plan` (ours), which reads as a sequence
            what the controller wants before the world answers.
        posterior_input: What q sees of xi: `scaled` to the observation range (the paper), or the `residual`
            around the per-step median in units of each dimension's spread (ours).
        channels: Convolution channels of q, reversed in the `deconv` trunk of p(xi|tau).
        decoder_hidden: Hidden units of the `mlp` trunk of p(xi|tau).
        rank: Coefficients of the low-rank head.
        prior_hidden: Channels (`deconv`) or hidden units (`mlp`) of p(tau, psi|x); for `plan`, filters of the
            convolution, units of each recurrent layer, and hidden units.
        badness_hidden: Hidden units of p(y|psi).
        latent_scale: Bounds of the latent scales; they start at the geometric mean.
        observation_scale: Bounds of the scales of xi: in units of the mean absolute residual of each
            dimension for `low-rank`, of the observation range for `dense`.
        badness_scale: Bounds of the scale of y.
        plan_channels: Channels of a controller's plan, for the prior `plan`; 0 for the others.
        plan_steps: Samples of a plan.
    """

    controller_dim: int
    observation_dim: int
    time_steps: int
    path_length: int = 3
    tau_dim: int = 3
    psi_dim: int = 1
    distribution: str = "laplace"
    head: str = "low-rank"
    trunk: str = "mlp"
    prior: str = "mlp"
    posterior_input: str = "residual"
    channels: tuple[int, ...] = (32, 64, 128)
    decoder_hidden: tuple[int, ...] = (384, 384)
    rank: int = 80
    prior_hidden: tuple[int, ...] = (384, 384, 384)
    badness_hidden: tuple[int, ...] = (64, 64)
    latent_scale: ScaleBounds = ScaleBounds(1e-2, 100.0)
    observation_scale: ScaleBounds = ScaleBounds(0.1, 10.0)
    badness_scale: ScaleBounds = ScaleBounds(1e-2, 1.0)
    plan_channels: int = 0
    plan_steps: int = 50

    def __post_init__(self) -> None:
        """Refuse unknown choices and sizes no network can be built from."""
        for name, allowed in _CHOICES.items():
            if getattr(self, name) not in allowed:
                raise ValueError(f"{name} must be one of {', '.join(allowed)}, got {getattr(self, name)!r}")
        for name in _SIZES:
            _require_positive(name, [getattr(self, name)])
        if self.psi_dim < 0:
            raise ValueError(f"psi_dim must be at least 1, or 0 for the SVAE, got {self.psi_dim}")
        for name in ("channels", "decoder_hidden", "prior_hidden", "badness_hidden"):
            _require_positive(name, getattr(self, name))
        if self.prior == "plan":
            self._require_plan()
        if encoded_length(self.time_steps, len(self.channels)) < 1:
            raise ValueError(
                f"time_steps must be long enough for {len(self.channels)} convolutions of width {KERNEL} and "
                f"stride {STRIDE}, got {self.time_steps}; lower the training stride"
            )

    def _require_plan(self) -> None:
        if self.plan_channels < 1 or self.plan_steps < 1:
            raise ValueError(
                "the prior `plan` needs a controller that offers its plan, got one of "
                f"{self.plan_channels} channels and {self.plan_steps} steps: choose the prior `mlp`"
            )
        if len(self.prior_hidden) < 3:
            raise ValueError(
                "the prior `plan` needs at least 3 hidden sizes (filters, recurrent units, hidden units), "
                f"got {self.prior_hidden}"
            )

    @property
    def tau_size(self) -> int:
        """Elements of the flattened latent path tau."""
        return self.path_length * self.tau_dim

    @property
    def psi_size(self) -> int:
        """Elements of the flattened psi."""
        return self.path_length * self.psi_dim

    @property
    def has_psi(self) -> bool:
        """Whether this is the SVAE-DC, and not the SVAE that sees only trajectories."""
        return self.psi_dim > 0

    @property
    def latent_size(self) -> int:
        """Elements of the latent code [tau, psi]."""
        return self.tau_size + self.psi_size

    def to_dict(self) -> dict[str, Any]:
        """Plain built-in values, for checkpoints and logs."""
        return asdict(self)

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> "ModelConfig":
        """Inverse of `to_dict`.

        Raises:
            ValueError: A value is refused, or a name is unknown or missing.
        """
        tuples = {name: tuple(value) for name, value in values.items() if isinstance(value, list | tuple)}
        bounds = {name: ScaleBounds(**value) for name, value in values.items() if isinstance(value, dict)}
        try:
            return cls(**{**values, **tuples, **bounds})
        except TypeError as error:
            raise ValueError(f"not a model configuration of this version: {error}") from error


def encoded_length(steps: int, layers: int) -> int:
    """Count the steps that convolutions without padding leave.

    Args:
        steps: Length of the sequence.
        layers: Convolutions of width `KERNEL` and stride `STRIDE`.

    Returns:
        Length afterwards; below 1 when the sequence is too short.
    """
    for _ in range(layers):
        steps = (steps - KERNEL) // STRIDE + 1
    return steps


def decoded_length(steps: int, layers: int) -> int:
    """Count the steps that transposed convolutions make.

    Args:
        steps: Length of the sequence, at least 1.
        layers: Transposed convolutions of width `KERNEL` and stride `STRIDE`.

    Returns:
        Length afterwards.
    """
    for _ in range(layers):
        steps = (steps - 1) * STRIDE + KERNEL
    return steps


def _require_positive(name: str, values: Sequence[int]) -> None:
    if not values or min(values) < 1:
        raise ValueError(f"{name} must be at least 1 everywhere, got {values}")
