"""Both engines are told the same robots: kinematics and dynamics agree where no contact is involved."""

import numpy as np
import pytest

from workers import setups
from workers.environments.daisy import HOME
from workers.rollout import draw


@pytest.fixture(params=["franka", "yumi"])
def arms(request):
    """The same arm in PyBullet and in MuJoCo, at home."""
    name = request.param
    physics = draw(setups.load(name), 0, 0)[1]
    with setups.load(name).open() as bullet, setups.load(f"{name}-mujoco").open() as mujoco:
        bullet.reset(physics)
        mujoco.reset(physics)
        yield bullet.arm, mujoco.arm


def test_hands_are_at_the_same_place(arms):
    one, other = (arm.state for arm in arms)
    assert one.joints == pytest.approx(other.joints)
    assert one.position == pytest.approx(other.position, abs=1e-6)
    same = abs(np.dot(one.orientation, other.orientation))
    assert same == pytest.approx(1.0, abs=1e-6)


def test_jacobians_are_the_same(arms):
    for one, other in zip(*(arm.jacobian() for arm in arms), strict=True):
        joints = len(arms[1].state.joints)
        assert np.array(one)[:, :joints] == pytest.approx(np.array(other)[:, :joints], abs=1e-9)


def test_gravity_takes_the_same_torques(arms):
    one, other = (arm.gravity_torque() for arm in arms)
    assert one[: len(other)] == pytest.approx(other, abs=1e-6)
    assert np.abs(other).max() > 1.0


@pytest.mark.parametrize("name", ["franka-mujoco", "yumi-mujoco"])
def test_objects_stand_where_they_were_put_until_something_touches_them(name):
    setup = setups.load(name)
    physics = draw(setup, 0, 0)[1]
    with setup.open() as environment:
        environment.reset(physics)
        resting = environment.arm.gravity_torque() if name.startswith("franka") else [0.0] * 7
        records = [environment.step(resting) for _ in range(250)]
    xi = environment.observed(records).xi
    assert np.ptp(xi[7:], axis=1) == pytest.approx(0.0, abs=2e-3)


def test_daisy_stands_at_home():
    setup = setups.load("daisy-27d-mujoco")
    with setup.open() as environment:
        environment.reset(draw(setup, 0, 0)[1])
        records = [environment.step(HOME) for _ in range(120)]
    observed = environment.observed(records)
    assert observed.xi[20, -1] == pytest.approx(0.3, abs=0.02)
    assert not observed.signals["elbow_contact"].any()
