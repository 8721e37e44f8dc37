"""The simulated Franka scene: kinematics, gravity, torques, contacts."""

from dataclasses import replace

import numpy as np
import pybullet
import pytest
from scipy.spatial.transform import Rotation

from workers import setups
from workers.environments.tabletop import first_two_axes
from workers.setups import franka
from workers.simulation.arm import Arm
from workers.simulation.world import World


@pytest.fixture(scope="module")
def scene():
    with setups.load("franka").open() as environment:
        yield environment


@pytest.fixture
def rested(scene):
    scene.reset(franka.MODEL.nominal_physics())
    return scene


def test_the_hand_starts_where_its_forward_kinematics_say(rested):
    assert rested.arm.state.position == pytest.approx((0.230, 0.291, 0.205), abs=1e-3)
    roll, pitch, _ = Rotation.from_quat(rested.arm.state.orientation).as_euler("xyz", degrees=True)
    assert abs(roll) == pytest.approx(173, abs=1)
    assert pitch == pytest.approx(14.5, abs=0.5)


def test_gravity_torques_alone_hold_the_arm_still(rested):
    start = np.array(rested.arm.state.joints)
    for _ in range(100):
        rested.step(rested.arm.gravity_torque()[:7])
    assert np.abs(np.array(rested.arm.state.joints) - start).max() < 1e-3


def test_without_them_the_arm_falls(rested):
    start = rested.arm.state.position[2]
    for _ in range(100):
        rested.step([0.0] * 7)
    assert rested.arm.state.position[2] < start - 0.02


HALF = np.pi / 2
# Denavit and Hartenberg in Craig's form: each joint's origin in m in the one before, and its roll in rad.
FRAMES = (
    ((0.0, 0.0, 0.333), 0.0),
    ((0.0, 0.0, 0.0), -HALF),
    ((0.0, -0.316, 0.0), HALF),
    ((0.0825, 0.0, 0.0), HALF),
    ((-0.0825, 0.384, 0.0), -HALF),
    ((0.0, 0.0, 0.0), HALF),
    ((0.088, 0.0, 0.0), HALF),
)
ONE_JOINT = [(joint, sign) for joint in range(7) for sign in (-1.0, 1.0) if (joint, sign) != (1, -1.0)]


def _push(scene, joint: int, torque: float) -> np.ndarray:
    start = np.array(scene.arm.state.joints)
    for _ in range(10):
        command = np.array(scene.arm.gravity_torque()[:7])
        command[joint] += torque
        scene.step(command.tolist())
    return np.array(scene.arm.state.joints) - start


@pytest.mark.parametrize(("joint", "sign"), ONE_JOINT)
def test_a_torque_on_one_joint_turns_that_joint_its_way(rested, joint, sign):
    moved = _push(rested, joint, sign * 5.0)
    assert sign * moved[joint] > 1e-5
    assert sign * rested.arm.state.speeds[joint] > 0.0


def test_a_joint_at_its_limit_does_not_pass_it(rested):
    """The second joint starts at its lower limit of 0."""
    assert abs(_push(rested, 1, -5.0)[1]) < 1e-4


@pytest.mark.parametrize("joint", range(7))
def test_a_joint_turns_the_hand_about_its_own_axis(rested, joint):
    """The hand's pose against the chain of the manufacturer's frames, with one joint turned by 0.2 rad."""
    turned = np.array(franka.ARM.home)
    turned[joint] += 0.2
    client, body = rested.arm._client, rested.arm.body
    for index, angle in zip(rested.arm._joints, turned, strict=True):
        pybullet.resetJointState(body, index, angle, physicsClientId=client)
    state = rested.arm.refresh()
    origin, rotation = np.zeros(3), Rotation.identity()
    for (place, roll), angle in zip(FRAMES, turned, strict=True):
        origin = origin + rotation.apply(place)
        rotation = rotation * Rotation.from_euler("x", roll) * Rotation.from_euler("z", angle)
    flange = origin + rotation.apply((0.0, 0.0, 0.107))
    assert state.position == pytest.approx(flange, abs=1e-4)
    hand = rotation * Rotation.from_euler("z", -np.pi / 4)
    assert (hand * Rotation.from_quat(state.orientation).inv()).magnitude() < 1e-3


def test_hand_velocities_are_the_jacobian_times_the_joint_speeds(rested):
    rng = np.random.default_rng(0)
    for _ in range(50):
        rested.step(rng.uniform(-12, 12, 7).tolist())
        state = rested.arm.state
        linear, angular = (np.array(part)[:, :7] for part in rested.arm.jacobian())
        assert linear @ state.speeds == pytest.approx(state.velocity, abs=1e-6)
        assert angular @ state.speeds == pytest.approx(state.angular_velocity, abs=1e-6)


def test_hand_velocity_is_the_change_of_its_position(rested):
    before = np.array(rested.arm.state.position)
    for _ in range(20):
        rested.step([20.0, 0.0, -20.0, 10.0, 5.0, -5.0, 5.0])
    before = np.array(rested.arm.state.position)
    rested.step(rested.arm.gravity_torque()[:7])
    change = (np.array(rested.arm.state.position) - before) / rested.control_step
    assert change == pytest.approx(rested.arm.state.velocity, abs=0.02)


def test_joints_stay_near_their_limits_under_full_torque(rested):
    for _ in range(500):
        record = rested.step([87.0] * 4 + [12.0] * 3)
    xi = rested.observed([record]).xi[:, 0]
    for value, channel in zip(xi[:7], rested.observation, strict=False):
        assert channel.low <= value <= channel.high, channel.name


def test_no_object_touches_the_arm_at_the_start(rested):
    """Bullet reports pairs within its margin; the gap must be positive and nothing may push."""
    client = rested.arm._client
    pybullet.performCollisionDetection(physicsClientId=client)
    contacts = pybullet.getContactPoints(bodyA=rested.arm.body, physicsClientId=client)
    assert all(contact[8] > 0.0 for contact in contacts)
    assert min(contact[8] for contact in contacts) == pytest.approx(0.0009, abs=3e-4)
    for _ in range(50):
        record = rested.step(rested.arm.gravity_torque()[:7])
    xi = rested.observed([record]).xi[:, 0]
    assert xi[[7, 8, 16, 17]] == pytest.approx([0.32, 0.15, 0.50, 0.15], abs=1e-4)


def test_objects_rest_upright_at_their_starts(rested):
    xi = rested.observed([rested.record()]).xi[:, 0]
    assert xi[7:10] == pytest.approx([0.32, 0.15, 0.111], abs=1e-6)
    assert xi[10:16] == pytest.approx([1, 0, 0, 0, 1, 0], abs=1e-6)


def test_an_arm_lying_on_the_table_touches_it(rested):
    for _ in range(700):
        record = rested.step([0.0] * 7)
    assert bool(rested.observed([record]).signals["table_contact"][0])


def test_orientation_columns_equal_those_of_scipy():
    rotations = Rotation.random(50, random_state=0)
    expected = rotations.as_matrix()[:, :, :2].transpose(2, 1, 0).reshape(6, 50)
    assert first_two_axes(rotations.as_quat()) == pytest.approx(expected, abs=1e-12)


def test_restitution_of_an_object_decides_how_high_it_bounces():
    """Bullet multiplies both bodies' values: against a plane of 0 nothing ever bounced."""
    heights = []
    for restitution in (0.0, 0.9):
        scene = setups.load("franka").open()
        physics = franka.MODEL.nominal_physics() | {"object2_restitution": restitution}
        scene.reset(physics)
        body = scene._cylinders[1].body
        start = (0.5, -0.3, 0.5)
        client = scene.arm._client
        pybullet.resetBasePositionAndOrientation(body, start, (0, 0, 0, 1), physicsClientId=client)
        z = [scene.observed([scene.step(scene.arm.gravity_torque()[:7])]).xi[18, 0] for _ in range(500)]
        landed = int(np.argmin(z))
        heights.append(max(z[landed:]) - z[landed])
        scene.close()
    assert heights[1] > heights[0] + 0.05


def test_a_joint_the_robot_does_not_have_is_refused_by_name():
    model = replace(franka.ARM, hand="panda_thumb")
    with (
        World(time_step=0.002, solver_iterations=10) as world,
        pytest.raises(ValueError, match="panda_thumb"),
    ):
        Arm(world, model)


def test_a_robot_description_that_is_not_there_is_named():
    model = replace(franka.ARM, urdf="no/such.urdf")
    with (
        World(time_step=0.002, solver_iterations=10) as world,
        pytest.raises(FileNotFoundError, match="such"),
    ):
        Arm(world, model)


@pytest.mark.parametrize("text", ["", "no robot", "<robot name='a'><link name='b'>", "<sdf/>"])
def test_a_robot_description_that_does_not_load_is_named(tmp_path, text):
    path = tmp_path / "broken.urdf"
    path.write_text(text)
    with (
        World(time_step=0.002, solver_iterations=10) as world,
        pytest.raises(ValueError, match=r"broken\.urdf does not load as a URDF"),
    ):
        Arm(world, replace(franka.ARM, urdf=str(path)))


def test_a_home_pose_outside_the_limits_is_refused():
    with pytest.raises(ValueError, match="home of panda_joint1"):
        replace(franka.ARM, home=(9.0, *franka.ARM.home[1:]))
    with pytest.raises(ValueError, match="lower must hold one angle per joint"):
        replace(franka.ARM, lower=franka.ARM.lower[1:])


def test_closing_twice_is_harmless():
    world = World(time_step=0.002, solver_iterations=10)
    world.close()
    world.close()
    assert world.client == -1
