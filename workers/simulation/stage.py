"""A scene to look at: the bodies with all that can be seen of them, put where one says, never simulated."""

import math
from collections.abc import Iterable, Sequence
from pathlib import Path
from tempfile import NamedTemporaryFile

import numpy as np
from jaxtyping import UInt8, UInt16

from workers.simulation.bullet import pybullet
from workers.simulation.description import require_joints, robot_path
from workers.simulation.scenery import Camera
from workers.simulation.server import Server
from workers.simulation.shapes import Surface

_BASE = -1
_LOCAL_POSITION, _LOCAL_ORIENTATION = 3, 4  # in a body's dynamics: the centre of mass in the base's frame
_ORIGIN = (0.0, 0.0, 0.0)
_NEAR, _FAR = 0.01, 60.0  # m; where the near plane is further, Bullet's shadows cover everything
_FINER = 2  # pixels drawn along each side of one that is shown, to smooth edges
_LIGHT = {
    "lightColor": (1.0, 1.0, 1.0),
    "lightDistance": 7.0,
    "shadow": 1,
    "lightAmbientCoeff": 0.45,
    "lightDiffuseCoeff": 0.6,
    "lightSpecularCoeff": 0.05,
}
_SKY = np.array([[196, 212, 228], [240, 244, 247]])  # red, green, blue at the top and the bottom


class Scene(Server):
    """A PyBullet server with visual shapes; it draws in memory and needs no screen."""

    def __init__(self) -> None:
        super().__init__()
        self._joints: dict[int, list[int]] = {}

    def add_machine(self, urdf: Path | str, joints: Sequence[str]) -> int:
        """Load a robot with its visual shapes.

        Args:
            urdf: text, or a file: absolute, or below the folder of PyBullet's own robots.
            joints: names of those that `bend` sets, in its order.

        Returns:
            Its body.

        Raises:
            ValueError: the robot has no joint of such a name.
        """
        body = self._load(urdf)
        index = self._joint_indices(body)
        require_joints(index, "the robot", joints)
        self._joints[body] = [index[name] for name in joints]
        return body

    def _load(self, urdf: Path | str) -> int:
        if isinstance(urdf, Path):
            return pybullet.loadURDF(str(robot_path(urdf)), useFixedBase=True, physicsClientId=self.client)
        with NamedTemporaryFile("w", encoding="utf-8", suffix=".urdf") as file:  # Bullet reads files only
            file.write(urdf)
            file.flush()
            return pybullet.loadURDF(file.name, useFixedBase=True, physicsClientId=self.client)

    def _joint_indices(self, body: int) -> dict[str, int]:
        count = pybullet.getNumJoints(body, physicsClientId=self.client)
        infos = (pybullet.getJointInfo(body, i, physicsClientId=self.client) for i in range(count))
        return {info[1].decode(): info[0] for info in infos}

    def add_surface(self, surface: Surface) -> int:
        """Add a body that is only that surface; returns the body."""
        shape = pybullet.createVisualShape(
            pybullet.GEOM_MESH,
            vertices=surface.vertices(),
            indices=surface.indices(),
            normals=surface.normals(),
            rgbaColor=(*surface.color, 1.0),
            specularColor=(0.0, 0.0, 0.0),
            physicsClientId=self.client,
        )
        return pybullet.createMultiBody(0.0, -1, shape, physicsClientId=self.client)

    def put(self, body: int, position: Sequence[float], orientation: Sequence[float]) -> None:
        """Put the frame of a body's base somewhere.

        Args:
            body: as from `add_machine` or `add_surface`.
            position: of the frame, in m.
            orientation: of the frame, a quaternion (x, y, z, w).
        """
        dynamics = pybullet.getDynamicsInfo(body, _BASE, physicsClientId=self.client)
        center = pybullet.multiplyTransforms(  # Bullet places the centre of mass
            position, orientation, dynamics[_LOCAL_POSITION], dynamics[_LOCAL_ORIENTATION]
        )
        pybullet.resetBasePositionAndOrientation(body, *center, physicsClientId=self.client)

    def bend(self, body: int, angles: Iterable[float]) -> None:
        """Set the joints of a robot.

        Args:
            body: as from `add_machine`.
            angles: in rad, in the order in which the joints were named.
        """
        for joint, angle in zip(self._joints[body], angles, strict=True):
            pybullet.resetJointState(body, joint, angle, physicsClientId=self.client)

    def picture(self, camera: Camera, width: int, height: int) -> UInt8[np.ndarray, "height width 3"]:
        """Draw what a camera sees that looks at the origin.

        Bullet's light aims at the origin as well, and shadows fall only in what it sees from there.

        Args:
            camera: its target and what it follows are not used.
            width: in pixels.
            height: in pixels.

        Returns:
            Red, green and blue, from the top left, [height, width, 3].
        """
        view = pybullet.computeViewMatrixFromYawPitchRoll(
            _ORIGIN, camera.distance, camera.yaw, camera.pitch, 0.0, upAxisIndex=2
        )
        _, _, colors, _, bodies = pybullet.getCameraImage(
            width * _FINER,
            height * _FINER,
            view,
            pybullet.computeProjectionMatrixFOV(camera.angle, width / height, _NEAR, _FAR),
            renderer=pybullet.ER_TINY_RENDERER,
            lightDirection=_sun(camera.yaw),
            physicsClientId=self.client,
            **_LIGHT,
        )
        shape = (height * _FINER, width * _FINER)
        seen = np.array(colors, dtype=np.uint16).reshape(*shape, 4)[..., :3]
        row, column = np.nonzero(np.reshape(bodies, shape) < 0)
        seen[row, column] = _sky(shape[0])[row]
        shares = [seen[i::_FINER, j::_FINER] for i in range(_FINER) for j in range(_FINER)]
        return (np.stack(shares).sum(axis=0, dtype=np.uint16) // _FINER**2).astype(np.uint8)


def _sun(yaw: float) -> tuple[float, float, float]:
    """Towards a light from behind a camera of that yaw, from its left and high above it."""
    azimuth = math.radians(yaw - 90.0 - 50.0)
    return math.cos(azimuth), math.sin(azimuth), 1.7


def _sky(height: int) -> UInt16[np.ndarray, "height 3"]:
    share = np.linspace(0.0, 1.0, height)[:, None]
    return ((1.0 - share) * _SKY[0] + share * _SKY[1]).astype(np.uint16)
