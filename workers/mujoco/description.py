"""Descriptions of robots, read by MuJoCo from the same URDF files and texts that PyBullet reads."""

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import mujoco

from workers.simulation.description import require_description

_PACKAGE = "package://"


def read_robot(urdf: Path | str) -> Any:
    """Read a robot's description; nothing of it touches anything yet, and every link stays a body.

    Args:
        urdf: a file, or the description itself as text.

    Returns:
        A `mujoco.MjSpec`, whose geoms are named after their links: `hand`, and `hand_2` for a second one.

    Raises:
        FileNotFoundError: there is no such file.
        ValueError: MuJoCo does not take it; the message has its words, and the file.
    """
    spec = _read(urdf)
    spec.compiler.fusestatic = False
    spec.compiler.discardvisual = False  # it has been done; now it would be what touches nothing yet
    for mesh in spec.meshes:
        mesh.file = mesh.file.removeprefix(_PACKAGE)
    for body in spec.bodies:
        for number, geom in enumerate(body.geoms, 1):
            geom.name = body.name if number == 1 else f"{body.name}_{number}"
            geom.contype = geom.conaffinity = 0
    return spec


def child_links(path: Path) -> dict[str, str]:
    """The link that each joint of a URDF file carries; MuJoCo keeps no names of joints that do not move."""
    joints = ElementTree.parse(path).getroot().iterfind("joint")
    return {joint.attrib["name"]: joint.find("child").attrib["link"] for joint in joints}  # type: ignore[union-attr]


def compile_scene(spec: Any, owner: object) -> Any:
    """Compile a scene.

    Args:
        spec: a `mujoco.MjSpec`.
        owner: the file or robot that it describes, for the error.

    Returns:
        A `mujoco.MjModel`.

    Raises:
        ValueError: MuJoCo does not take it; the message has its words.
    """
    try:
        return spec.compile()
    except ValueError as error:
        raise _refusal(owner, error) from error


def _read(urdf: Path | str) -> Any:
    if isinstance(urdf, Path):
        require_description(urdf)
    try:
        read = mujoco.MjSpec.from_file if isinstance(urdf, Path) else mujoco.MjSpec.from_string
        return read(str(urdf))
    except ValueError as error:
        raise _refusal(urdf if isinstance(urdf, Path) else f"{urdf[:60]!r}", error) from error


def _refusal(owner: object, error: ValueError) -> ValueError:
    said = " ".join(str(error).split())
    return ValueError(
        f"MuJoCo does not take {owner}: {said}; every link, joint and mesh it names must exist, meshes "
        "relative to the file, and every link that moves needs a mass and an inertia"
    )
