"""The setups that ship, in MuJoCo."""

from dataclasses import replace
from functools import partial

from workers.environments.daisy import DaisyModel
from workers.environments.environment import Environment
from workers.environments.tabletop import TabletopModel
from workers.mujoco import extra
from workers.setups.setup import Setup


def in_mujoco(setup: Setup, model: TabletopModel | DaisyModel) -> Setup:
    """Make the twin of a setup in another engine, with the same controllers, channels and physics.

    Args:
        setup: in PyBullet.
        model: of its scene.

    Returns:
        A setup whose name ends in -mujoco.

    Raises:
        MissingExtraError: MuJoCo is not installed.
    """
    extra.require_installed()
    name = f"{setup.name}-mujoco"
    return replace(setup, name=name, build=partial(_open, model), packages=extra.PACKAGES)


def _open(model: TabletopModel | DaisyModel) -> Environment:
    """MuJoCo is imported here: that takes a second, which a list of setups need not."""
    if isinstance(model, DaisyModel):
        from workers.environments.mujoco_daisy import MujocoDaisy

        return MujocoDaisy(model)
    from workers.environments.mujoco_tabletop import MujocoTabletop

    return MujocoTabletop(model)
