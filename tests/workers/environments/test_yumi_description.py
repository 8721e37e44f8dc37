"""The YuMi's description: what its module writes, with the limits of the arm and the moments of its parts."""

import xml.etree.ElementTree as ElementTree
from pathlib import Path

import numpy as np
import pytest

from workers.environments import yumi_description
from workers.environments.yumi_description import Capsule
from workers.setups import yumi

DESCRIPTION = Path(yumi.ARM.urdf)


def test_the_description_is_what_its_module_writes():
    assert DESCRIPTION.read_text() == "\n".join(yumi_description.lines()) + "\n"


def test_limits_of_the_description_are_those_of_the_arm_model():
    limits = {
        joint.get("name"): joint.find("limit").attrib
        for joint in ElementTree.parse(DESCRIPTION).iter("joint")
        if joint.get("type") == "revolute"
    }
    for name, low, high, speed in zip(
        yumi.ARM.joints, yumi.ARM.lower, yumi.ARM.upper, yumi.JOINT_SPEEDS, strict=True
    ):
        assert [float(limits[name][key]) for key in ("lower", "upper", "velocity")] == [low, high, speed]


def test_moments_of_a_capsule_are_those_of_many_points():
    capsule = Capsule((0.1, 0.0, -0.1), (0.1, 0.0, 0.1), 0.1)
    points = np.random.default_rng(0).uniform((-0.1, -0.1, -0.2), (0.1, 0.1, 0.2), (400_000, 3))
    beyond = np.maximum(np.abs(points[:, 2]) - 0.1, 0.0)
    points = points[points[:, 0] ** 2 + points[:, 1] ** 2 + beyond**2 <= 0.01]
    x2, y2, z2 = np.mean(points**2, axis=0)
    assert capsule.moments(1.0) == pytest.approx((y2 + z2, x2 + y2), rel=0.01)
    assert capsule.volume == pytest.approx(0.016 * len(points) / 400_000, rel=0.01)
