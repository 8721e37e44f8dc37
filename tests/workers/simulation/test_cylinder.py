"""A free cylinder, against the moments of a solid one."""

import pybullet
import pytest

from workers.simulation.cylinder import Cylinder
from workers.simulation.world import World

COEFFICIENTS = {"friction": 0.3, "rolling_friction": 0.01, "restitution": 0.05}


@pytest.fixture
def world():
    with World(time_step=0.001, solver_iterations=20) as opened:
        yield opened


def test_its_mass_and_inertia_are_those_of_a_solid_cylinder(world):
    cylinder = Cylinder(world, radius=0.1, height=0.4, position=(0.5, -0.2))
    cylinder.set_dynamics(mass=3.0, **COEFFICIENTS)
    info = pybullet.getDynamicsInfo(cylinder.body, -1, physicsClientId=world.client)
    across = 3.0 * (3 * 0.1**2 + 0.4**2) / 12
    assert info[0] == 3.0
    assert info[2] == pytest.approx((across, across, 3.0 * 0.1**2 / 2))


def test_it_stands_at_its_start_and_returns_there_upright_and_at_rest(world):
    cylinder = Cylinder(world, radius=0.1, height=0.4, position=(0.5, -0.2))
    cylinder.set_dynamics(mass=3.0, **COEFFICIENTS)
    cylinder.reset()
    start = cylinder.pose()
    assert start[0] == pytest.approx((0.5, -0.2, 0.2), abs=2e-3)
    pybullet.resetBaseVelocity(cylinder.body, (1.0, 0.0, 0.0), (0.0, 5.0, 0.0), physicsClientId=world.client)
    for _ in range(50):
        world.step()
    assert cylinder.pose() != start
    cylinder.reset()
    assert cylinder.pose() == start
    velocity = pybullet.getBaseVelocity(cylinder.body, physicsClientId=world.client)
    assert velocity == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
