"""The simulated YuMi: kinematics, the order of its joints, speeds, limits, contacts."""

import xml.etree.ElementTree as ElementTree
from itertools import pairwise
from pathlib import Path

import numpy as np
import pybullet
import pytest
from scipy.spatial.transform import Rotation

from workers import setups
from workers.environments.yumi_description import ARM, ARM_MASS, CAPSULES, GRIPPER_MASS
from workers.setups import yumi

DESCRIPTION = Path(yumi.ARM.urdf)


@pytest.fixture(scope="module")
def setup():
    return setups.load("yumi")


@pytest.fixture(scope="module")
def scene(setup):
    with setup.open() as environment:
        yield environment


@pytest.fixture
def rested(setup, scene):
    scene.reset({name: (low + high) / 2 for name, (low, high) in setup.physics.intervals.items()})
    return scene


def _moved(scene, joint: int, speed: float, steps: int = 50) -> np.ndarray:
    start = np.array(scene.arm.state.joints)
    for _ in range(steps):
        scene.step([speed if each == joint else 0.0 for each in range(7)])
    return np.array(scene.arm.state.joints) - start


def test_the_hand_starts_where_its_forward_kinematics_say_pointing_forwards(rested):
    assert rested.arm.state.position == pytest.approx((0.302, -0.500, 0.169), abs=1e-3)
    pointing = Rotation.from_quat(rested.arm.state.orientation).apply((0.0, 0.0, 1.0))
    assert pointing == pytest.approx((1.0, 0.0, 0.0), abs=0.02)


def test_joint_seven_is_the_third_of_the_chain(rested):
    """A swapped order would move the wrong joint of a real robot, at full speed."""
    assert [joint.number for joint in ARM] == [1, 2, 7, 3, 4, 5, 6]
    assert yumi.ARM.joints == tuple(f"yumi_joint_{joint.number}_r" for joint in ARM)
    assert [channel.name for channel in rested.observation[:7]] == list(yumi.ARM.joints)
    parents = {}
    for joint in ElementTree.parse(DESCRIPTION).iter("joint"):
        parents[joint.get("name")] = (joint.find("parent").get("link"), joint.find("child").get("link"))
    chain = [parents[name] for name in yumi.ARM.joints]
    assert all(child == parent for (_, child), (parent, _) in pairwise(chain))


@pytest.mark.parametrize("sign", [-1.0, 1.0])
@pytest.mark.parametrize("joint", range(7))
def test_a_speed_of_one_joint_turns_that_joint_alone_its_way(rested, joint, sign):
    moved = _moved(rested, joint, sign * 0.5)
    assert 0.04 < sign * moved[joint] < 0.051  # motors of finite force need a few steps to get there
    assert np.delete(moved, joint) == pytest.approx(0.0, abs=1e-3)
    assert rested.arm.state.speeds[joint] == pytest.approx(sign * 0.5, rel=0.02)


@pytest.mark.parametrize("joint", range(7))
def test_a_joint_turns_what_lies_beyond_it_about_its_own_axis(rested, joint):
    """The hand's displacement against ω × r from frames computed here, link by link."""
    origin, rotation = np.array(yumi.ARM.base), Rotation.identity()
    frames = []
    for each, angle in zip(ARM, yumi.ARM.home, strict=True):
        origin = origin + rotation.apply(each.xyz)
        rotation = rotation * Rotation.from_euler("xyz", each.rpy) * Rotation.from_rotvec((0, 0, angle))
        frames.append((origin, rotation.apply((0.0, 0.0, 1.0))))
    hand = np.array(rested.arm.state.position)
    assert hand == pytest.approx(origin, abs=1e-5)
    center, axis = frames[joint]
    moved = _moved(rested, joint, 0.1, steps=10)[joint]
    expected = center + Rotation.from_rotvec(moved * axis).apply(hand - center)
    assert rested.arm.state.position == pytest.approx(expected, abs=2e-4)


def test_motors_hold_the_arm_against_gravity(rested):
    moved = _moved(rested, 0, 0.0, steps=500)
    assert np.abs(moved).max() < 1e-3


def test_motors_reach_the_wanted_speeds_when_nothing_is_in_the_way(setup, rested):
    limits = np.array(setup.controller._limits)
    for step in range(100):
        wanted = 0.2 * limits * step / 100 * (-1, 1, -1, 1, -1, 1, -1)
        wanted[0] = 0.0  # away from the table
        rested.step(wanted.tolist())
    assert rested.arm.state.speeds == pytest.approx(wanted, abs=0.01)


def test_no_object_touches_the_arm_at_the_start(rested):
    client = rested.arm._client
    pybullet.performCollisionDetection(physicsClientId=client)
    contacts = pybullet.getContactPoints(bodyA=rested.arm.body, physicsClientId=client)
    assert all(contact[8] > 0.0 for contact in contacts)
    for _ in range(50):
        record = rested.step([0.0] * 7)
    xi = rested.observed([record]).xi[:, 0]
    assert xi[[7, 8, 16, 17]] == pytest.approx([0.31, -0.30, 0.43, -0.30], abs=1e-4)
    assert xi[[9, 18]] == pytest.approx(0.110, abs=2e-4)


def test_an_arm_driven_down_touches_the_table(rested):
    """The second joint lowers the upper arm, and the hand with it."""
    records = [rested.step([0.0, -0.8, *[0.0] * 5]) for _ in range(600)]
    touches = rested.observed(records).signals["table_contact"]
    assert not touches[0]
    assert touches[-1]


def test_bullet_takes_masses_and_inertias_as_they_are_written(rested):
    arm, client = rested.arm.body, rested.arm._client
    infos = [pybullet.getDynamicsInfo(arm, link, physicsClientId=client) for link in range(8)]
    assert sum(info[0] for info in infos) == pytest.approx(ARM_MASS + GRIPPER_MASS, abs=1e-3)
    density = ARM_MASS / sum(capsule.volume for capsule in CAPSULES)
    for info, capsule in zip(infos, CAPSULES, strict=False):
        across, along = capsule.moments(density * capsule.volume)
        assert info[2] == pytest.approx((across, across, along), rel=1e-3)
