"""The simulated Daisy: its joints one by one, and the ground under it."""

from xml.etree import ElementTree

import numpy as np
import pybullet
import pytest
from scipy.spatial.transform import Rotation

from workers import setups
from workers.environments import daisy, daisy_body
from workers.environments.daisy import NOMINAL, Daisy, DaisyModel

HOME = np.array(daisy.HOME)

REACH = (3.0, 3.0, 3.0)

FEET = {leg: 3 * number + 2 for number, leg in enumerate(daisy_body.LEGS)}


@pytest.fixture(scope="module")
def scene():
    with setups.load("daisy-27d").open() as environment:
        yield environment


@pytest.fixture
def rested(scene):
    scene.reset(NOMINAL)
    return scene


def _lift(scene, height: float, turn=(0.0, 0.0, 0.0, 1.0)) -> None:
    pybullet.resetBasePositionAndOrientation(
        scene.robot.body, (0, 0, height), turn, physicsClientId=scene._world.client
    )


def _foot(scene, leg: str) -> np.ndarray:
    """Where the end of a leg's tibia is."""
    state = pybullet.getLinkState(scene.robot.body, FEET[leg], 1, 1, physicsClientId=scene._world.client)
    tip = Rotation.from_quat(state[5]).apply((daisy_body.TUBE_LENGTH, 0.0, 0.0))
    return np.array(state[4]) + tip


def _gaps(scene) -> list[float]:
    contacts = pybullet.getContactPoints(scene.robot.body, physicsClientId=scene._world.client)
    return [contact[8] for contact in contacts]


def test_parts_weigh_what_the_robot_s_facts_say(scene):
    links = range(-1, 18)
    client = scene._world.client
    infos = [pybullet.getDynamicsInfo(scene.robot.body, link, physicsClientId=client) for link in links]
    assert sum(info[0] for info in infos) == pytest.approx(20.234, abs=1e-6)
    assert [info[0] for info in infos[:4]] == pytest.approx([7.88, 0.715, 0.882, 0.462])
    for info in infos:
        x, y, z = info[2]
        assert min(x, y, z) > 0.0
        assert x + y > z
        assert y + z > x
        assert z + x > y


def test_bullet_keeps_the_inertia_of_the_description(scene):
    """It sets impossible ones to zero, and without the flag computes its own."""
    infos = [
        pybullet.getDynamicsInfo(scene.robot.body, link, physicsClientId=scene._world.client)[2]
        for link in range(-1, 18)
    ]
    described = [
        [float(inertia.get(axis)) for axis in ("ixx", "iyy", "izz")]
        for inertia in ElementTree.fromstring(daisy_body.urdf()).iter("inertia")
    ]
    assert np.array(infos) == pytest.approx(np.array(described))


def test_legs_stand_in_their_places(rested):
    """Front legs at +y, left legs at −x."""
    for leg in daisy_body.LEGS:
        x, y, _ = _foot(rested, leg)
        assert x < 0 if leg[0] == "L" else x > 0, leg
        assert {"F": y > 0.3, "M": abs(y) < 0.05, "B": y < -0.3}[leg[1]], leg


@pytest.mark.parametrize("joint", range(18))
@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_command_to_one_joint_turns_that_joint_its_way(rested, joint, sign):
    _lift(rested, 2.0)
    target = HOME.copy()
    target[joint] += sign * 0.3
    for _ in range(12):
        record = rested.step(target.tolist())
    moved = rested.observed([record]).xi[:18, 0] - HOME
    assert 0.15 < sign * moved[joint] < 0.45  # rad
    assert np.abs(np.delete(moved, joint)).max() < 0.1


@pytest.mark.parametrize("leg", daisy_body.LEGS)
def test_left_legs_go_down_with_positive_shoulders_and_right_ones_mirror_them(rested, leg):
    client, body, base = rested._world.client, rested.robot.body, FEET[leg] - 2
    side = 1.0 if leg[0] == "L" else -1.0
    before = _foot(rested, leg)
    pybullet.resetJointState(body, base + 1, side * 0.2, physicsClientId=client)
    assert _foot(rested, leg)[2] < before[2] - 0.05
    pybullet.resetJointState(body, base + 1, 0.0, physicsClientId=client)
    pybullet.resetJointState(body, base + 2, 0.0, physicsClientId=client)
    stretched = _foot(rested, leg)
    assert stretched[2] > before[2] + 0.3  # it was bent down
    pybullet.resetJointState(body, base, side * 0.2, physicsClientId=client)
    assert _foot(rested, leg)[1] < stretched[1]  # the leg swings backwards


def test_it_settles_at_thirty_centimetres_on_six_feet(rested):
    for _ in range(30):
        record = rested.step(daisy.HOME)
    observed = rested.observed([record])
    assert observed.xi[18:21, 0] == pytest.approx((0.0, 0.0, 0.300), abs=2e-3)
    assert observed.xi[21:, 0] == pytest.approx((1, 0, 0, 0, 1, 0), abs=5e-3)
    assert np.abs(observed.signals["joint_speeds"]).max() < 0.1
    assert not observed.signals["elbow_contact"][0]
    assert len(_gaps(rested)) == 6
    assert min(_gaps(rested)) > -1e-3


def test_nothing_touches_the_ground_at_the_start(rested):
    near = pybullet.getClosestPoints(
        rested.robot.body, rested._world.plane, 0.1, physicsClientId=rested._world.client
    )
    assert min(point[8] for point in near) == pytest.approx(0.005, abs=5e-4)
    assert rested.observed([rested.record()]).xi[18:21, 0] == pytest.approx((0, 0, 0.305), abs=1e-6)


def test_it_keeps_standing(rested):
    for _ in range(400):
        record = rested.step(daisy.HOME)
    assert rested.observed([record]).xi[18:21, 0] == pytest.approx((0.0, 0.0, 0.3), abs=0.03)


def test_the_body_s_origin_is_reported_wherever_the_robot_is_turned(rested):
    turn = Rotation.from_euler("xyz", (0.4, -0.7, 1.9))
    _lift(rested, 1.0, tuple(turn.as_quat()))
    expected = np.array((0.0, 0.0, 1.0)) - turn.apply(daisy_body.body().center)
    assert rested.observed([rested.record()]).xi[18:21, 0] == pytest.approx(expected, abs=1e-6)


def test_a_robot_on_its_back_is_tilted_and_scrapes(rested):
    _lift(rested, 0.3, (0.0, 1.0, 0.0, 0.0))
    for _ in range(60):
        record = rested.step(daisy.HOME)
    bad = setups.load("daisy-27d").task.is_bad(rested.observed([record]))
    assert bad[1, 0]
    assert bad[2, 0]


def test_bent_knees_put_the_elbows_on_the_ground(rested):
    down = np.tile([0.0, 0.9, 1.2], (6, 1)) * np.array([1, -1, 1, -1, 1, -1])[:, None]
    for _ in range(90):
        record = rested.step(down.ravel().tolist())
    assert rested.observed([record]).signals["elbow_contact"][0]


def test_legs_that_sweep_backwards_together_carry_the_body_forwards(rested):
    sweep = HOME.reshape(6, 3).copy()
    sweep[:, 0] = 0.3 * np.array([1, -1, 1, -1, 1, -1])
    for _ in range(60):
        record = rested.step(sweep.ravel().tolist())
    assert rested.observed([record]).xi[19, 0] > 0.03


def test_restitution_decides_how_high_it_bounces(scene):
    heights = []
    for restitution in (0.0, 0.9):
        scene.reset(NOMINAL | {"restitution": restitution})
        _lift(scene, 0.8)
        z = [scene.observed([scene.step(daisy.HOME)]).xi[20, 0] for _ in range(60)]
        landed = int(np.argmin(z))
        heights.append(max(z[landed:]) - z[landed])
    assert heights[1] > heights[0] + 0.02


def _fastest(speeds) -> np.ndarray:
    """Greatest speed of each kind of joint on the way to a distant pose, in the air."""
    with Daisy(DaisyModel(speeds=speeds, reach=REACH)) as scene:
        scene.reset(NOMINAL)
        _lift(scene, 5.0)
        target = (HOME + 1.5 * np.repeat([1, -1, 1, -1, 1, -1], 3)).tolist()
        records = [scene.step(target) for _ in range(30)]
        speeds_seen = np.abs(scene.observed(records).signals["joint_speeds"])
    return speeds_seen.reshape(6, 3, -1).max(axis=(0, 2))


def test_motors_with_their_true_limits_do_not_exceed_them():
    assert np.all(_fastest(daisy.TRUE_SPEEDS) < np.array(daisy.TRUE_SPEEDS) * 1.1)


def test_motors_without_limits_do():
    assert np.all(_fastest(daisy.UNLIMITED) > np.array(daisy.TRUE_SPEEDS) * 1.3)


def test_a_world_thrown_into_nonsense_recovers(scene):
    scene.reset(NOMINAL)
    expected = [scene.step(daisy.HOME) for _ in range(20)]
    for _ in range(3):
        scene.step([float("nan")] * 18)
    scene.reset(NOMINAL)
    assert [scene.step(daisy.HOME) for _ in range(20)] == expected


@pytest.mark.parametrize(
    ("name", "speeds", "friction"),
    [
        ("daisy-27d", daisy.UNLIMITED, 2.0),
        ("daisy-11d", daisy.UNLIMITED, 2.0),
        ("daisy-11d-rehearsal", (3.142, 1.571, 3.142), 1.0),
    ],
)
def test_only_the_rehearsal_has_the_true_speed_limits_and_slippery_ground(name, speeds, friction):
    setup = setups.load(name)
    with setup.open() as environment:
        assert environment._robot_model.speeds == speeds * 6
    assert setup.gap("paper").intervals["friction"] == (friction, friction)
