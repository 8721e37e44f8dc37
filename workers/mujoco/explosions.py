"""Simulations that explode."""

from typing import Any

import mujoco


def keep_exploded(model: Any) -> None:
    """Let a simulation that explodes stay so, for MuJoCo sets it back to its start and goes on."""
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
