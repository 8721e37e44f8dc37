"""Robot descriptions in URDF files: loaded by Bullet, or refused with its reason."""

import ctypes
import os
import re
import sys
import tempfile
from collections.abc import Callable, Collection, Iterable, Sequence
from pathlib import Path
from typing import Any

import pybullet_data

from workers.simulation.bullet import pybullet

_OUTPUT = 1
_PREFIX = re.compile(r"b3\w+\[[^\]]*\]:\s*")


def robot_path(urdf: Path | str) -> Path:
    """Where a robot's URDF file is: below the folder of robots that ships with PyBullet, or absolute."""
    return Path(pybullet_data.getDataPath()) / urdf


def require_description(path: Path) -> None:
    """Refuse to go on without a robot's file.

    Raises:
        FileNotFoundError: there is no such file; the error names those beside it.
    """
    if not path.is_file():
        there = ", ".join(sorted(each.name for each in path.parent.glob("*.urdf"))) or "no *.urdf"
        raise FileNotFoundError(f"there is no robot description {path}; the folder holds {there}")


def require_joints(found: Collection[str], described: object, needed: Iterable[str]) -> None:
    """Refuse a robot that lacks a joint.

    Args:
        found: names of its joints.
        described: the file, for the error.
        needed: joints that it must have.

    Raises:
        ValueError: one of them is missing; the error names it, and all that there are.
    """
    missing = [name for name in needed if name not in found]
    if missing:
        raise ValueError(f"{described} has no joint {missing[0]!r}; it has {', '.join(found) or 'none'}")


def load_robot(path: Path, client: int, **options: Any) -> int:
    """Load the robot that a URDF file describes.

    Args:
        path: of the file.
        client: of the physics server.
        options: further ones of `pybullet.loadURDF`, such as `useFixedBase`.

    Returns:
        Bullet's number of the robot.

    Raises:
        FileNotFoundError: there is no such file; the error names those beside it.
        ValueError: Bullet cannot load it; the error says why.
    """
    require_description(path)

    def load() -> int:
        return pybullet.loadURDF(str(path), physicsClientId=client, **options)

    try:
        return load()
    except pybullet.error as error:
        reason = _PREFIX.sub(" ", _said(load)).split()
        raise ValueError(
            f"{path} does not load as a URDF: {' '.join(reason) or 'Bullet gives no reason'}; every link, "
            "joint and mesh it names must exist, meshes relative to the file"
        ) from error


def joint_indices(body: int, client: int, described: object, needed: Sequence[str]) -> dict[str, int]:
    """Look up the joints of a robot.

    Args:
        body: of the robot.
        client: of the physics server.
        described: the file, for the error.
        needed: joints that it must have.

    Returns:
        Bullet's index of every joint, by name.

    Raises:
        ValueError: one of them is missing; the error names it, and all that there are.
    """
    count = pybullet.getNumJoints(body, physicsClientId=client)
    infos = (pybullet.getJointInfo(body, index, physicsClientId=client) for index in range(count))
    found = {info[1].decode(): info[0] for info in infos}
    require_joints(found, described, needed)
    return found


def _said(load: Callable[[], object]) -> str:
    """What Bullet's C code prints on standard output while it fails: it has no other way to say why."""
    sys.stdout.flush()
    flush = ctypes.CDLL(None).fflush
    flush(None)
    kept = os.dup(_OUTPUT)
    with tempfile.TemporaryFile() as heard:
        os.dup2(heard.fileno(), _OUTPUT)
        try:
            load()
        except pybullet.error:
            flush(None)
        finally:
            os.dup2(kept, _OUTPUT)
            os.close(kept)
        heard.seek(0)
        return heard.read().decode(errors="replace")
