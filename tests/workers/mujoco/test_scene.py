"""Contacts bounce as their coefficient of restitution says."""

import math

import mujoco
import numpy as np
import pytest

from workers.mujoco import scene
from workers.mujoco.description import compile_scene
from workers.mujoco.simulation import Simulation


def _bounce(restitution: float) -> float:
    """Share of its speed that a cylinder keeps when it falls flat onto the ground from 20 cm."""
    spec = mujoco.MjSpec()
    spec.option.timestep = 1e-4
    scene.add_ground(spec)
    scene.add_cylinder(spec, "roll", radius=0.05, height=0.1, position=(0.0, 0.0))
    scene.add_pair(spec, "roll", scene.GROUND, rolls=False)
    spec.body("roll").pos[2] += 0.2
    simulation = Simulation(compile_scene(spec, "a roll"), joints=(), poses=("roll",))
    scene.set_mass(simulation.model, "roll", 1.0, (1e-3, 1e-3, 1e-3))
    scene.set_contact(
        simulation.model, "roll:ground", friction=0.5, rolling_friction=0.0, restitution=restitution
    )
    simulation.reset([])
    speeds = []
    for _ in range(3000):
        simulation.step(())
        speeds.append(simulation.data.qvel[2])
    return max(speeds) / -min(speeds)


def test_more_restitution_bounces_higher():
    shares = [_bounce(restitution) for restitution in (0.0, 0.3, 0.6, 0.9)]
    assert shares == sorted(shares)
    assert shares[0] < 0.2  # no contact of MuJoCo's takes all of the speed
    assert shares[2] == pytest.approx(0.6, abs=0.1)
    assert shares[3] == pytest.approx(0.9, abs=0.1)


@pytest.mark.parametrize(("restitution", "ratio"), [(0.0, 1.0), (-0.1, 1.0), (math.exp(-math.pi), 0.5**0.5)])
def test_damping_ratio_is_that_of_the_spring_with_that_bounce(restitution, ratio):
    assert scene.damping_ratio(restitution) == pytest.approx(ratio)


def test_a_reset_leaves_nothing_behind(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    spec = mujoco.MjSpec()
    scene.add_ground(spec)
    scene.add_cylinder(spec, "roll", radius=0.05, height=0.1, position=(0.2, 0.1))
    scene.add_pair(spec, "roll", scene.GROUND, rolls=True)
    simulation = Simulation(compile_scene(spec, "a roll"), joints=(), poses=("roll",))
    runs = []
    for speed in (0.0, np.nan, 3.0, 0.0):
        simulation.reset([])
        simulation.data.qvel[:] = speed
        for _ in range(20):
            simulation.step(())
        runs.append(simulation.record())
    assert runs[0].tobytes() == runs[-1].tobytes()
    assert np.isnan(runs[1]).any()  # exploded, and MuJoCo did not set it back
    assert abs(runs[2][0] - 0.2) > 0.01
    assert list(tmp_path.iterdir()) == []  # MuJoCo would leave MUJOCO_LOG.TXT
    assert capfd.readouterr().err == ""
