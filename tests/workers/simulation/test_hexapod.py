"""Robots of six legs whose descriptions do not load or fit are refused."""

from dataclasses import replace

import pytest

from workers.environments import daisy, daisy_body
from workers.simulation.hexapod import Hexapod
from workers.simulation.world import World


def test_a_description_without_a_joint_is_refused_by_its_name():
    text = daisy_body.urdf().replace('joint name="RM_elbow"', 'joint name="RM_knee"')
    with (
        World(time_step=1 / 240, solver_iterations=20) as world,
        pytest.raises(ValueError, match="RM_elbow"),
    ):
        Hexapod(world, replace(daisy.ROBOT, urdf=text))


def test_a_description_that_does_not_load_is_refused_with_its_beginning():
    with (
        World(time_step=1 / 240, solver_iterations=20) as world,
        pytest.raises(ValueError, match=r"must be a URDF that Bullet can load, got '<robot name=\"half"),
    ):
        Hexapod(world, replace(daisy.ROBOT, urdf='<robot name="half"><link'))


def test_models_that_do_not_fit_their_joints_are_refused():
    with pytest.raises(ValueError, match="home must hold one number per joint"):
        replace(daisy.ROBOT, home=daisy.HOME[1:])
    with pytest.raises(ValueError, match="all finite or all infinite"):
        replace(daisy.ROBOT, speeds=(1.0,) + daisy.UNLIMITED * 5 + daisy.UNLIMITED[1:])
