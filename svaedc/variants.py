"""What a user may change of a preset, by name: one word each, so that a command line can say it."""

import difflib
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, Final

from svaedc.presets import Preset
from svaedc.settings import WEIGHTINGS

KEPT: Final = "preset"
"""Leaves a choice to the preset."""

LATENT_SIZES: Final = {
    "3x3": {"path_length": 3, "tau_dim": 3, "channels": (32, 64, 128)},
    "5x6": {"path_length": 5, "tau_dim": 6, "channels": (64, 128, 256)},
    "15x12": {"path_length": 15, "tau_dim": 12, "channels": (256, 512, 1024)},
}
"""K x tau_dim and hidden sizes: 9-D everywhere in the paper but for its larger 30-D space (hidden 256) and a
180-D one (hidden up to 1024)."""


def varied(preset: Preset, changes: Mapping[str, Any]) -> Preset:
    """The preset with some of its choices changed.

    Args:
        preset: Model and training.
        changes: Values by name; `VARIATIONS` has the names, and `preset` changes nothing. They are applied in
            the order of `VARIATIONS`, whatever their own: what is narrower comes after what holds it.

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
    "weighting": _weighting,
    "kl_weight": _kl_weight,
    "learning_rate": _learning_rate,
    "patience": _patience,
    "epoch_updates": _epoch_updates,
}
