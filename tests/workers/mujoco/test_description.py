"""What MuJoCo cannot read is refused with its own words and the file."""

import pytest

from workers.mujoco.description import child_links, compile_scene, read_robot

INERTIA = '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/>'
LINK = '<link name="{}"><inertial><mass value="1"/>' + INERTIA + "</inertial>{}</link>"
BALL = '<collision><geometry><sphere radius="0.1"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="palm.stl"/></geometry></collision>'


def text(*, hand: str = BALL * 2, parent: str = "base", kind: str = "revolute") -> str:
    joint = (
        f'<joint name="wrist" type="{kind}"><parent link="{parent}"/><child link="hand"/>'
        '<limit lower="-1" upper="1" effort="1" velocity="1"/></joint>'
    )
    return f'<robot name="r">{LINK.format("base", "")}{LINK.format("hand", hand)}{joint}</robot>'


@pytest.fixture
def path(tmp_path):
    return tmp_path / "robot.urdf"


def test_links_stay_bodies_and_shapes_are_named_after_them(path):
    path.write_text(text(kind="fixed"))
    for source in (path, text(kind="fixed")):
        spec = read_robot(source)
        assert [body.name for body in spec.bodies] == ["world", "base", "hand"]
        assert [geom.name for geom in spec.geoms] == ["hand", "hand_2"]
        assert compile_scene(spec, "r").nbody == 3
    assert child_links(path) == {"wrist": "hand"}


def test_a_file_that_is_not_there_is_refused_with_those_that_are(path):
    (path.parent / "arm.urdf").write_text(text())
    with pytest.raises(FileNotFoundError, match=r"robot\.urdf; the folder holds arm\.urdf"):
        read_robot(path)


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("", "XML"),
        ("<robot name='r'>\n<link name='base'>", "XML"),
        ("<urdf/>", "urdf"),
        (text(parent="bse"), "URDF joint parent or child missing"),
        (text(hand=MESH), r"palm\.stl"),
        (text().replace('mass value="1"', 'mass value="0"'), "mass"),
    ],
)
def test_a_description_that_mujoco_does_not_take_is_refused_with_its_words_and_the_file(path, source, reason):
    path.write_text(source)
    with pytest.raises(ValueError, match=rf"MuJoCo does not take .*robot\.urdf: .*{reason}.*must exist"):
        compile_scene(read_robot(path), path)
