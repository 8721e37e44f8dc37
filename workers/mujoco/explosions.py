"""Simulations that explode."""

from typing import Any

import mujoco


def keep_exploded(model: Any) -> None:
    """Let a simulation that explodes stay so, for MuJoCo sets it back to its start and goes on.

    Nor does MuJoCo write of it into a file in the working directory any more, or onto the terminal: the
    episode is a diverged one, and is counted.
    """
    logging = mujoco.MjLogConfig.get()
    logging.logto_file = logging.logto_console = False
    mujoco.MjLogConfig.set(logging)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
