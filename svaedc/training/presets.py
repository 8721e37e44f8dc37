"""Named configurations: the paper's own, and a compact one that trains on two CPU cores in minutes."""

import difflib
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final, NamedTuple

from svaedc.model.config import ModelConfig, ScaleBounds
from svaedc.training.config import WEIGHTINGS, StageSettings, TrainingSettings


@dataclass(frozen=True)
class Sizes:
    """Sizes that are not chosen.

    Attributes:
        controller_dim: D of x.
        observation_dim: Channels of xi.
        time_steps: Steps of xi after the training stride.
        plan_channels: Of what the controller wants; 0 where it offers no plan, or none is asked for.
    """

    controller_dim: int
    observation_dim: int
    time_steps: int
    plan_channels: int = 0


class Preset(NamedTuple):
    """A model and how it is trained."""

    model: ModelConfig
    training: TrainingSettings


def paper(sizes: Sizes) -> Preset:
    """The paper's configuration (sections 3 and 5), meant for a GPU.

    Laplace, dense head, x as a sequence through transposed convolutions, RMSprop (alpha 0.99), learning rate
    1e-4 halved every 5,000 updates down to 1e-5, batches of 32, one joint stage of unweighted ELBO from the
    first update.
    """
    model = ModelConfig(
        sizes.controller_dim,
        sizes.observation_dim,
        sizes.time_steps,
        distribution="laplace",
        head="dense",
        trunk="deconv",
        prior="deconv",
        posterior_input="scaled",
        prior_hidden=(512, 256, 128, 128),
        observation_scale=ScaleBounds(1e-3, 10.0),
        plan_channels=sizes.plan_channels,
    )
    joint = StageSettings(
        updates=100_000,
        optimiser="rmsprop",
        schedule="halving",
        learning_rate=1e-4,
        weight_decay=0.0,
        dropout=0.0,
        gradient_norm=math.inf,
    )
    weighting = replace(WEIGHTINGS["paper"], warm_up=0.0)
    training = TrainingSettings(joint, joint, weighting, batch_size=32)
    return Preset(model, training.with_updates(joint=joint.updates, prior=0))


def compact(sizes: Sizes) -> Preset:
    """Ours: low-rank head around the median, and generation in the objective; minutes on two cores.

    p(tau, psi|x) reads the controller's plan where it offers one, and is an MLP where it does not. The stride
    leaves 100 or 200 steps. Without generation in the objective the error of what is generated from x was .69
    of the median's instead of .59, and a second stage that refits p(tau, psi|x) alone made .60 of .59: it has
    no updates here. docs/results/models.md has the tables.
    """
    joint = StageSettings(
        updates=4_000,
        optimiser="adam",
        schedule="cosine",
        learning_rate=1e-3,
        weight_decay=0.0,
        dropout=0.0,
        gradient_norm=1.0,
    )
    prior = replace(joint, updates=0, dropout=0.3, weight_decay=1e-2)
    model = ModelConfig(
        sizes.controller_dim,
        sizes.observation_dim,
        sizes.time_steps,
        plan_channels=sizes.plan_channels,
    )
    made = Preset(model, TrainingSettings(joint, prior, WEIGHTINGS["hybrid"], batch_size=128))
    return _prior(made, "plan") if sizes.plan_channels else made


PRESETS: Final[dict[str, Callable[[Sizes], Preset]]] = {"paper": paper, "compact": compact}
_STRIDES: Final = {"paper": 1, "compact": 5}


def preset(name: str) -> Callable[[Sizes], Preset]:
    """Factory of the preset called `name`.

    Raises:
        LookupError: There is none; the nearest is named.
    """
    if name in PRESETS:
        return PRESETS[name]
    nearest = difflib.get_close_matches(name, PRESETS, n=1, cutoff=0.0)[0]
    raise LookupError(f"no preset called {name!r}; did you mean {nearest!r}? There are {', '.join(PRESETS)}")


def usual_stride(name: str) -> int:
    """Control steps between two samples of xi that the preset called `name` is meant for.

    Raises:
        LookupError: There is no such preset; the nearest is named.
    """
    preset(name)
    return _STRIDES[name]


KEPT: Final = "preset"
"""This value leaves a choice to the preset."""

LATENT_SIZES: Final = {
    "3x3": {"path_length": 3, "tau_dim": 3, "channels": (32, 64, 128)},
    "5x6": {"path_length": 5, "tau_dim": 6, "channels": (64, 128, 256)},
    "15x12": {"path_length": 15, "tau_dim": 12, "channels": (256, 512, 1024)},
}
"""These are K x tau_dim and hidden sizes: the paper has 9-D everywhere but for its larger 30-D space
(hidden 256) and a 180-D one (hidden up to 1024)."""


class _PriorHabits(NamedTuple):
    """How a kind of p(tau, psi|x) is built and trained.

    What reads plans can learn them by heart, and what a plan tells of badness drowns in the elements of xi.
    """

    hidden: tuple[int, ...]
    dropout: float = 0.0
    weight_decay: float = 0.0
    y_weight: float = 1.0


_PRIORS: Final = {
    "mlp": _PriorHabits((384, 384, 384)),
    "deconv": _PriorHabits((512, 256, 128, 128)),
    "plan": _PriorHabits((96, 160, 160, 256), dropout=0.1, weight_decay=1e-2, y_weight=30.0),
}


def vary(preset: Preset, changes: Mapping[str, Any]) -> Preset:
    """The preset with some of its choices changed.

    Args:
        preset: Model and training.
        changes: Values by name; `VARIATIONS` has the names, and `preset` changes nothing. They are applied in
            the order of `VARIATIONS`, whatever their own: what is narrower comes after what holds it.

    Returns:
        The changed preset; `preset` stays as it is.

    Raises:
        LookupError: There is no such choice, or it has no such value; the nearest is named.
        ValueError: A number is out of its range.
    """
    for name in changes:
        if name not in VARIATIONS:
            raise LookupError(_unknown("choice", name, VARIATIONS))
    for name, change in VARIATIONS.items():
        if changes.get(name, KEPT) != KEPT:
            preset = change(preset, changes[name])
    return preset


def _unknown(what: str, value: object, known: Mapping[str, Any]) -> str:
    nearest = difflib.get_close_matches(str(value), known, n=1, cutoff=0.0)[0]
    return f"no {what} called {value!r}; did you mean {nearest!r}? There are {', '.join(known)}"


def _chosen(what: str, value: object, known: Mapping[str, Any]) -> Any:
    if value not in known:
        raise LookupError(_unknown(what, value, known))
    return known[str(value)]


def _model(preset: Preset, value: str) -> Preset:
    psi_dim = _chosen("model", value, {"svae-dc": preset.model.psi_dim or 1, "svae": 0})
    return preset._replace(model=replace(preset.model, psi_dim=psi_dim))


def _latent(preset: Preset, value: str) -> Preset:
    sizes = _chosen("latent size", value, LATENT_SIZES)
    hidden = preset.model.prior_hidden
    if preset.model.prior == "deconv":
        hidden = (max(sizes["channels"][-1], hidden[0]), *hidden[1:])
    return preset._replace(model=replace(preset.model, prior_hidden=hidden, **sizes))


def _distribution(preset: Preset, value: str) -> Preset:
    return preset._replace(model=replace(preset.model, distribution=value))


def _head(preset: Preset, value: str) -> Preset:
    return preset._replace(model=replace(preset.model, head=value))


def _prior(preset: Preset, value: str) -> Preset:
    habits: _PriorHabits = _chosen("prior", value, _PRIORS)
    training = preset.training
    joint = replace(training.joint, dropout=habits.dropout, weight_decay=habits.weight_decay)
    weighting = replace(training.weighting, y=habits.y_weight)
    model = replace(preset.model, prior=value, prior_hidden=habits.hidden)
    return Preset(model, replace(training, joint=joint, weighting=weighting))


def _weighting(preset: Preset, value: str) -> Preset:
    weighting = _chosen("weighting", value, WEIGHTINGS)
    return preset._replace(training=replace(preset.training, weighting=weighting))


def _kl_weight(preset: Preset, value: float | int) -> Preset:
    weighting = replace(preset.training.weighting, kl=float(value))
    return preset._replace(training=replace(preset.training, weighting=weighting))


def _learning_rate(preset: Preset, value: float | int) -> Preset:
    joint = replace(preset.training.joint, learning_rate=float(value))
    return preset._replace(training=replace(preset.training, joint=joint))


def _epoch_updates(preset: Preset, value: int) -> Preset:
    return preset._replace(training=replace(preset.training, epoch_updates=value))


def _patience(preset: Preset, value: float | int) -> Preset:
    joint = replace(preset.training.joint, patience=float(value))
    prior = replace(preset.training.prior, patience=float(value))
    return preset._replace(training=replace(preset.training, joint=joint, prior=prior))


VARIATIONS: Final[dict[str, Callable[[Preset, Any], Preset]]] = {
    "model": _model,
    "latent": _latent,
    "distribution": _distribution,
    "head": _head,
    "prior": _prior,
    "weighting": _weighting,
    "kl_weight": _kl_weight,
    "learning_rate": _learning_rate,
    "patience": _patience,
    "epoch_updates": _epoch_updates,
}
