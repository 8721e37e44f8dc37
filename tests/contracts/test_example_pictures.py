"""The hopper of the examples is drawn where MuJoCo itself has it."""

from pathlib import Path

import numpy as np
import pytest

from workers import setups
from workers.rollout import random_episode


@pytest.fixture
def hopper(monkeypatch):
    pytest.importorskip("mujoco")
    monkeypatch.syspath_prepend(str(Path(__file__).parents[2] / "examples" / "gymnasium_hopper"))
    return setups.load("gymnasium_hopper")


def test_the_sketch_of_the_hopper_has_mujocos_joints_and_ends(hopper):
    import gymnasium_hopper

    with hopper.open() as environment:
        xi = random_episode(hopper, environment, 0, 2).xi
        mujoco = environment._world.unwrapped
    state = dict(zip((channel.name for channel in hopper.observation), xi[:, 60].astype(float), strict=True))
    mujoco.set_state(xi[:6, 60].astype(float), np.zeros(6))
    drawn = gymnasium_hopper.skeleton(state)
    expected = []
    for name, ends in (("torso", (1, -1)), ("thigh", (-1,)), ("leg", (-1,)), ("foot", (1, -1))):
        geom = mujoco.data.geom(f"{name}_geom")
        half = mujoco.model.geom(f"{name}_geom").size[1]
        axis = geom.xmat.reshape(3, 3)[:, 2]
        expected += [(geom.xpos + end * half * axis)[[0, 2]] for end in ends]
    heel, toe = sorted(expected[4:], key=lambda end: end[0])
    assert np.allclose(drawn, [*expected[:4], heel, toe], atol=1e-5)
