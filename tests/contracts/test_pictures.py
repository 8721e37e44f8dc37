"""What the pictures of every setup must obey."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pybullet
import pytest

from workers import setups
from workers.pictures import Show, Size, frames, pose_of, scenery_of
from workers.rollout import random_episode
from workers.simulation.stage import Scene

STEPS = 120  # long enough for an arm to reach its objects and for a walker to leave its start


def _visible() -> list[str]:
    """All but the setups that are formulas: a robot that lacks scenery must fail here."""
    return sorted(name for name in setups.SETUPS if not name.startswith("quadratic"))


@pytest.fixture(scope="module", params=_visible())
def setup(request):
    whole = setups.load(request.param)
    return replace(whole, horizon=min(whole.horizon, STEPS))


@pytest.fixture(scope="module")
def environment(setup):
    with setup.open() as opened:
        yield opened


@pytest.fixture(scope="module")
def episode(setup, environment):
    return random_episode(setup, environment, 0, 3)


def _bodies(client: int) -> list[int]:
    return list(range(pybullet.getNumBodies(physicsClientId=client)))


def _links(client: int, names: set[str]) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Frame (m, quaternion) of every link behind a joint of that name, as Bullet itself has it."""
    for body in _bodies(client):
        for joint in range(pybullet.getNumJoints(body, physicsClientId=client)):
            name = pybullet.getJointInfo(body, joint, physicsClientId=client)[1].decode()
            if name in names:
                state = pybullet.getLinkState(body, joint, computeForwardKinematics=1, physicsClientId=client)
                yield name, (*state[4], *state[5])


def _free(client: int) -> list[tuple[float, ...]]:
    """Pose of every body without joints, but for the ground."""
    single = [body for body in _bodies(client) if not pybullet.getNumJoints(body, physicsClientId=client)]
    return [sum(pybullet.getBasePositionAndOrientation(body, client), ()) for body in single]


def _simulated(environment, names: set[str]) -> tuple[dict[str, tuple[float, ...]], list[tuple[float, ...]]]:
    """Frames of the links behind joints of these names, and poses of the objects, as the engine has them."""
    if hasattr(environment, "_world"):
        client = environment._world.client
        return dict(_links(client, names)), _free(client)[1:]
    model, data = environment.simulation.model, environment.simulation.data

    def pose(body: int) -> tuple[float, ...]:
        return (*data.xpos[body], *np.roll(data.xquat[body], -1))

    joints = [(model.joint(index).name, model.jnt_bodyid[index]) for index in range(model.njnt)]
    objects = [body for name, body in joints if name.startswith("object")]
    return {name: pose(body) for name, body in joints if name in names}, list(map(pose, objects))


def _same(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    """Equal poses up to float32, in which ξ is; a quaternion and its negative are the same rotation."""
    turned = abs(float(np.dot(one[3:], other[3:])))
    return np.allclose(one[:3], other[:3], atol=1e-5) and turned > 1.0 - 1e-6


def test_the_replayed_scene_is_where_the_simulation_ended(setup, environment, episode):
    names = {channel.name for channel in setup.observation}
    random_episode(setup, environment, 0, 3)  # leaves the simulation at the episode's end
    simulated, objects = _simulated(environment, names)
    with Scene() as stage:
        show = Show(stage, environment.scenery, setup.observation)
        show.pose(episode.xi[:, -1], np.zeros(3))
        shown = dict(_links(stage.client, names))
        free = _free(stage.client)
    assert shown.keys() == simulated.keys()
    assert shown
    for name, pose in shown.items():
        assert _same(pose, simulated[name]), name
    assert all(any(_same(pose, other) for pose in free) for other in objects)
    assert all(any(_same(pose, other) for other in objects) for pose in free)


def test_drawing_changes_no_byte_of_an_episode(setup, environment, episode):
    pictures = list(frames(setup, episode.xi, [0, STEPS - 1], Size(64, 48)))
    again = random_episode(setup, environment, 0, 3)
    assert again.xi.tobytes() == episode.xi.tobytes()
    assert again.bad.tobytes() == episode.bad.tobytes()
    assert (again.f, again.y) == (episode.f, episode.y)
    assert [(picture.shape, picture.dtype.name) for picture in pictures] == 2 * [((48, 64, 3), "uint8")]
    assert (pictures[0] != pictures[1]).any()


def _shapes(client: int, body: int) -> tuple[list[tuple[int, str]], list[tuple[int, str]]]:
    """Link and mesh file ("" for none) of every shape of a body: what is touched, and what is seen."""
    links = range(-1, pybullet.getNumJoints(body, physicsClientId=client))
    touched = [(link, s[4]) for link in links for s in pybullet.getCollisionShapeData(body, link, client)]
    seen = [(s[1], s[4]) for s in pybullet.getVisualShapeData(body, physicsClientId=client)]
    return tuple(
        sorted((link, name.decode() if Path(name.decode()).is_file() else "") for link, name in shapes)
        for shapes in (touched, seen)
    )


def test_rollouts_load_nothing_that_is_only_seen(setup, environment):
    """Where a link has no visual shape, Bullet reports its collision shapes in their place."""
    if not hasattr(environment, "_world"):
        pytest.skip("MuJoCo leaves out what is only seen when it reads a URDF")
    client = environment._world.client
    for body in _bodies(client):
        touched, seen = _shapes(client, body)
        assert seen == touched
    with Scene() as stage:
        body = Show(stage, environment.scenery, setup.observation).bodies[0][0]
        touched, seen = _shapes(stage.client, body)
        assert seen != touched


def test_a_trajectory_of_another_setup_is_refused(setup):
    with pytest.raises(ValueError, match=f"xi of {setup.name} must be {len(setup.observation)} channels"):
        next(frames(setup, np.zeros((3, 10), dtype=np.float32), [0], Size(64, 48)))


def test_a_trajectory_that_is_not_finite_is_refused(setup, episode):
    xi = episode.xi.copy()
    xi[0, 0] = np.nan
    with pytest.raises(ValueError, match="1 that are not finite"):
        next(frames(setup, xi, [0], Size(64, 48)))


def test_the_middle_of_all_channels_can_be_drawn(setup):
    """An episode that exploded at once holds it in every step; its rotations have no direction."""
    middle = np.array([(c.low + c.high) / 2 for c in setup.observation], dtype=np.float32)
    picture = next(frames(setup, np.repeat(middle[:, None], 5, axis=1), [4], Size(64, 48)))
    assert picture.std() > 1.0


def test_an_inexact_rotation_is_made_exact():
    noisy = np.array([1.0, 2.0, 3.0, 0.0, 2.0, 0.0, -0.5, 0.3, 0.0], dtype=np.float32)
    position, orientation = pose_of(noisy)
    assert position.tolist() == [1.0, 2.0, 3.0]
    # x onto y and y onto -x is a quarter turn about z.
    assert np.allclose(np.abs(orientation), [0.0, 0.0, np.sqrt(0.5), np.sqrt(0.5)])


def test_an_environment_without_scenery_is_refused(setup):
    def bare():
        environment = setup.open()
        environment.scenery = None
        return environment

    with pytest.raises(LookupError, match=f"{setup.name} has nothing to see"):
        scenery_of(replace(setup, build=bare))


def test_a_size_that_cannot_be_drawn_is_refused():
    with pytest.raises(ValueError, match="height must be 16 to 4096 pixels, got 4"):
        Size(640, 4)
