"""The Franka with limited joint speeds, and the limit itself."""

from dataclasses import replace

import numpy as np
import pytest

from workers import setups
from workers.environments.tabletop import Tabletop
from workers.setups import franka


def _fastest(model) -> np.ndarray:
    """Highest speed of every joint under alternating full torques, in rad/s."""
    rng = np.random.default_rng(0)
    speeds = []
    with Tabletop(model) as scene:
        scene.reset(model.nominal_physics())
        for step in range(200):
            if step % 40 == 0:
                torque = rng.choice((-1.0, 1.0), 7) * franka.TORQUE_LIMITS
            scene.step(torque.tolist())
            speeds.append(np.abs(scene.arm.state.speeds))
    return np.max(speeds, axis=0)


@pytest.mark.parametrize("limit", [0.5, franka.SPEED_LIMIT])
def test_no_joint_is_faster_than_the_limit_and_the_fastest_reaches_it(limit):
    fastest = _fastest(replace(franka.MODEL, arm=replace(franka.ARM, speed_limit=limit)))
    assert fastest.max() == pytest.approx(limit, abs=1e-6)


def test_the_setup_has_none_and_its_stand_in_has_one():
    assert _fastest(franka.MODEL).max() > franka.SPEED_LIMIT
    with setups.load("franka-rehearsal").open() as scene:
        assert scene._model.arm.speed_limit == franka.SPEED_LIMIT


def test_it_differs_from_the_setup_only_in_name_and_simulation():
    stand_in, setup = setups.load("franka-rehearsal"), setups.load("franka")
    assert stand_in.name == "franka-rehearsal"
    assert stand_in.observation == setup.observation
    assert stand_in.controller.parameters == setup.controller.parameters
    assert (stand_in.task, stand_in.gaps, stand_in.stop) == (setup.task, setup.gaps, setup.stop)
