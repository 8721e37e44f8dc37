"""The waypoint controller's three formulas, and the controller as a whole."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from workers import setups
from workers.controllers.controller import unit_cube
from workers.controllers.end_effector import _force, _moment, _torque
from workers.setups import franka

LIMITS = franka.TORQUE_LIMITS
REST = (0.0, 0.0, 0.0)
numbers = st.floats(-1e4, 1e4)
triples = st.tuples(numbers, numbers, numbers)


@pytest.fixture(scope="module")
def setup():
    return setups.load("franka")


@pytest.fixture(scope="module")
def scene(setup):
    with setup.open() as environment:
        yield environment


@given(triples, triples, triples, triples, triples, st.floats(0, 500), st.floats(0, 50))
def test_force_is_a_spring_a_damper_and_a_feed_forward(p_, v_, a_, p, v, kp, kd):
    expected = kp * (np.array(p_) - p) + kd * (np.array(v_) - v) + a_
    assert _force((kp, kd), p_, v_, a_, p, v) == pytest.approx(tuple(expected), rel=1e-9, abs=1e-6)


@given(st.integers(0, 10_000), st.floats(1e-4, 3.0))
def test_moment_turns_about_the_axis_that_leads_to_the_wanted_orientation(seed, angle):
    rng = np.random.default_rng(seed)
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    present = Rotation.random(random_state=seed)
    wanted = Rotation.from_rotvec(angle * axis) * present
    moment = _moment((1.0, 0.0), wanted.as_quat().tolist(), REST, present.as_quat().tolist(), REST)
    assert moment == pytest.approx(tuple(2 * np.sin(angle / 2) * axis), abs=1e-9)


def test_moment_does_not_depend_on_the_sign_of_a_quaternion():
    one = _moment((1.0, 0.0), [0.6, 0.0, 0.0, 0.8], REST, [0.0, 0.0, 0.0, 1.0], REST)
    other = _moment((1.0, 0.0), [-0.6, 0.0, 0.0, -0.8], REST, [0.0, 0.0, 0.0, 1.0], REST)
    assert one == pytest.approx(other)


def test_moment_damps_the_difference_of_the_spins():
    same = (0.0, 0.0, 0.0, 1.0)
    assert _moment((1.0, 0.1), same, (1.0, 2.0, 3.0), same, (0.0, 0.0, 1.0)) == pytest.approx((0.1, 0.2, 0.2))


@given(st.integers(0, 10_000))
def test_torque_is_the_transposed_jacobian_times_the_wrench_within_the_limits(seed):
    rng = np.random.default_rng(seed)
    jacobian, wrench, gravity = rng.normal(size=(6, 9)), 40 * rng.normal(size=6), 20 * rng.normal(size=9)
    rows = tuple(map(tuple, jacobian.tolist()))
    force, moment = tuple(wrench[:3].tolist()), tuple(wrench[3:].tolist())
    found = _torque(force, moment, (rows[:3], rows[3:]), gravity.tolist(), LIMITS)
    expected = np.clip((jacobian.T @ wrench + gravity)[:7], -np.array(LIMITS), LIMITS)
    assert found == pytest.approx(expected.tolist())


def test_the_first_command_pulls_towards_the_first_waypoint(setup, scene):
    scene.reset(franka.MODEL.nominal_physics())
    x = np.full(48, 0.5, dtype=np.float32)
    command = setup.controller.start(x, scene, setup.horizon)
    start = np.array(scene.arm.state.position)
    first = setup.controller.values(x)[:3]
    for step in range(60):
        scene.step(command(step))
    moved = np.array(scene.arm.state.position) - start
    assert moved @ (first - start) > 0.0


def test_the_motion_begins_at_the_hand_so_that_the_first_command_is_gentle(setup, scene):
    """Nothing but gravity and the feed-forward at the start: no jump towards a distant waypoint."""
    scene.reset(franka.MODEL.nominal_physics())
    x = np.full(48, 0.5, dtype=np.float32)
    first = np.array(setup.controller.start(x, scene, setup.horizon)(0))
    assert np.abs(first - scene.arm.gravity_torque()[:7]).max() < 20.0


def test_the_middle_of_the_wanted_orientations_is_that_of_the_palm_facing_down(setup):
    """In rad about x, y and z; degrees taken for them would point anywhere."""
    middle = setup.controller.values(np.full(48, 0.5, dtype=np.float32))[3:6]
    down = Rotation.from_euler("xyz", middle).apply((0.0, 0.0, 1.0))
    assert down == pytest.approx((0.0, 0.0, -1.0), abs=1e-6)


def test_the_hand_turns_towards_the_wanted_orientation(setup, scene):
    """Of two controllers that differ in the yaw they want, each ends nearer to its own."""
    ends = {}
    for yaw in (0.0, 1.0):
        scene.reset(franka.MODEL.nominal_physics())
        x = np.full((6, 8), 0.5, dtype=np.float32)
        x[:, 5] = yaw
        command = setup.controller.start(x.ravel(), scene, setup.horizon)
        for step in range(250):
            scene.step(command(step))
        wanted = Rotation.from_euler("xyz", setup.controller.values(x.ravel())[3:6])
        ends[yaw] = wanted, Rotation.from_quat(scene.arm.state.orientation)
    for yaw, (wanted, reached) in ends.items():
        other = ends[1.0 - yaw][1]
        assert (wanted * reached.inv()).magnitude() < (wanted * other.inv()).magnitude() - 0.02


def test_parameters_run_from_their_low_to_their_high_end(setup):
    low, high = (setup.controller.values(np.full(48, end, dtype=np.float32)) for end in (0.0, 1.0))
    assert low == pytest.approx([parameter.low for parameter in setup.controller.parameters])
    assert high == pytest.approx([parameter.high for parameter in setup.controller.parameters])
    assert [parameter.name for parameter in setup.controller.parameters[6:9]] == [
        "waypoint1_stiffness",
        "waypoint1_damping",
        "waypoint2_x",
    ]


def test_controllers_are_rounded_to_float32():
    assert unit_cube([0.1, 0.2], 2).dtype == np.float32
    assert unit_cube(np.array([1.0 + 1e-12]), 1)[0] == 1.0
