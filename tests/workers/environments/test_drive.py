"""What a command does to an arm: as torques, and as speeds."""

import pytest

from workers.environments.drive import SpeedDrive, TorqueDrive
from workers.setups import franka
from workers.simulation.arm import Arm
from workers.simulation.world import World


@pytest.fixture(scope="module")
def held():
    """The Franka's arm alone in a world of 1 ms steps."""
    with World(time_step=0.001, solver_iterations=50) as world:
        yield world, Arm(world, franka.ARM)


def moved(held, apply, command, steps: int = 20):
    world, arm = held
    arm.reset()
    for _ in range(steps):
        apply(command)
        world.step()
    return arm.refresh()


def test_torques_that_hold_against_gravity_leave_the_arm_at_rest(held):
    drive = TorqueDrive(franka.TORQUE_LIMITS)
    held[1].reset()
    holding = held[1].gravity_torque()[:7]
    assert moved(held, drive.bind(held[1]), holding).speeds == pytest.approx([0.0] * 7, abs=0.02)
    fallen = moved(held, drive.bind(held[1]), [0.0] * 7).speeds
    assert max(map(abs, fallen)) > 0.1
    assert drive.unit == "N·m"


def test_motors_reach_the_commanded_speeds_if_they_have_the_force(held):
    wanted = [0.2, 0.1, 0.2, -0.2, 0.2, -0.2, 0.2]
    strong, weak = (SpeedDrive((1.0,) * 7, force=force) for force in (500.0, 0.0))
    assert moved(held, strong.bind(held[1]), wanted).speeds == pytest.approx(wanted, abs=0.01)
    assert moved(held, weak.bind(held[1]), wanted).speeds != pytest.approx(wanted, abs=0.01)
    assert strong.unit == "rad/s"
