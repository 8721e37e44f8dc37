"""MuJoCo, where it is installed."""

from importlib import import_module
from typing import Any

PACKAGES = ("mujoco",)
"""Versions of these decide the bytes of an episode."""
REMEDY = "install the extra: pip install 'svaedc[mujoco]'"


class MissingExtraError(LookupError):
    """A package is missing that is no requirement of every installation; the message names its extra."""


def import_extra(name: str) -> Any:
    """Import a package of the extra.

    Raises:
        MissingExtraError: it is not there.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise MissingExtraError(
            f"setups in MuJoCo need the package {name}, which does not import here ({error}); {REMEDY}"
        ) from error


mujoco = import_extra("mujoco")


def keep_exploded(model: Any) -> None:
    """Let a simulation that explodes stay so, for MuJoCo sets it back to its start and goes on."""
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
