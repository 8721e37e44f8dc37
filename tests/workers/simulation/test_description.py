"""Robots of users' own: descriptions that do not load are refused with Bullet's reason."""

import pytest

from workers.simulation.bullet import pybullet
from workers.simulation.description import joint_indices, load_robot
from workers.simulation.world import World

INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
LINK = '<link name="{}"><inertial><mass value="1"/>' + INERTIA + "</inertial>{}</link>"
JOINT = (
    '<joint name="wrist" type="{}"><parent link="{}"/><child link="hand"/>'
    '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
)
MESH = '<collision><geometry><mesh filename="palm.stl"/></geometry></collision>'


def description(*, joint: str = "revolute", parent: str = "base", hand: str = "") -> str:
    links = LINK.format("base", "") + LINK.format("hand", hand)
    return f'<robot name="r">{links}{JOINT.format(joint, parent)}</robot>'


@pytest.fixture
def client():
    with World(time_step=0.01, solver_iterations=10) as world:
        yield world.client


@pytest.fixture
def path(tmp_path):
    return tmp_path / "robot.urdf"


def test_a_description_loads_and_its_joints_are_found_by_name(client, path):
    path.write_text(description())
    body = load_robot(path, client, useFixedBase=True)
    assert joint_indices(body, client, path, ["wrist"]) == {"wrist": 0}
    assert pybullet.getBodyInfo(body, physicsClientId=client)[1] == b"r"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "gives no reason"),
        ("a robot", "XML_ERROR_PARSING_TEXT .*Line number=1"),
        ("<robot name='r'>\n<link name='base'>", "XML_ERROR_PARSING .*Line number=2"),
        ("<urdf/>", "expected a robot element"),
        ("<robot name='r'/>", "No links found"),
        (description(joint="hinge"), "wrist has unknown type: hinge"),
        (description(parent="bse"), "Cannot find parent link for a joint wrist"),
        (description(hand=MESH), r"cannot find 'palm\.stl'.*failed to parse link"),
    ],
)
def test_a_description_that_does_not_load_is_refused_with_the_file_and_the_reason(
    client, path, text, reason, capfd
):
    path.write_text(text)
    with pytest.raises(ValueError, match=rf"robot\.urdf does not load as a URDF: .*{reason}"):
        load_robot(path, client)
    print("still printing")
    assert "still printing" in capfd.readouterr().out


def test_a_missing_file_is_refused_with_those_that_are_there(client, path):
    with pytest.raises(FileNotFoundError, match=r"no robot description .*robot\.urdf; .* holds no \*\.urdf"):
        load_robot(path, client)
    path.write_text(description())
    with pytest.raises(FileNotFoundError, match=r"robt\.urdf; the folder holds robot\.urdf"):
        load_robot(path.with_name("robt.urdf"), client)


def test_a_missing_joint_is_named_with_those_that_are_there(client, path):
    path.write_text(description())
    body = load_robot(path, client)
    with pytest.raises(ValueError, match=r"robot\.urdf has no joint 'elbow'; it has wrist"):
        joint_indices(body, client, path, ["wrist", "elbow"])
