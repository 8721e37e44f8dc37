"""What there is to see of an environment: bodies, the ground, and where to look from; data only.

What moves has the names of its channels in ξ: joints their own, and a free pose `object1` nine, `object1_x`,
`_y`, `_z` (m) and two columns of its rotation matrix, `object1_first_axis_x` to `object1_second_axis_z`.
"""

import math
from dataclasses import dataclass
from pathlib import Path

Vector = tuple[float, float, float]
Interval = tuple[float, float]

POSE_CHANNELS = (
    *("x", "y", "z"),
    *(f"{column}_axis_{axis}" for column in ("first", "second") for axis in "xyz"),
)
"""In the names of its channels these follow the name of a pose, in this order."""


@dataclass(frozen=True)
class Machine:
    """A robot.

    Attributes:
        urdf: its description as text, or a file: absolute, or below the folder of PyBullet's own robots.
        joints: names of the joints that ξ holds.
        place: where its base stays, in m, or the name of the base's pose in ξ.
    """

    urdf: Path | str
    joints: tuple[str, ...]
    place: Vector | str


@dataclass(frozen=True)
class Roll:
    """A cylinder: radius and height in m, and the name of its pose in ξ."""

    radius: float
    height: float
    place: str


@dataclass(frozen=True)
class Ground:
    """A chequered plane z = 0.

    Attributes:
        tile: edge of a tile in m.
        x: extent in m of the lighter part, where the task happens; may be infinite.
        y: the same along y.
        numbered: where along x, in m, numbers tell every metre of y; none for nowhere.
    """

    tile: float
    x: Interval
    y: Interval
    numbered: tuple[float, ...]

    def __post_init__(self) -> None:
        """Refuse tiles without size and parts without width."""
        if not (math.isfinite(self.tile) and self.tile > 0.0):
            raise ValueError(f"tile must be a length above 0 m, got {self.tile}")
        for name in ("x", "y"):
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} of the ground must satisfy low < high, got ({low}, {high})")


@dataclass(frozen=True)
class Camera:
    """Where pictures are taken from.

    Attributes:
        target: the point in their middle, in m; from the followed body's x and y if there is one.
        follows: name of a pose in ξ; "" for a camera that stands still.
        distance: from the target, in m.
        yaw: in degrees; 0 looks along +y, 90 along −x.
        pitch: in degrees, below 0 when it looks down.
        angle: of view, from top to bottom, in degrees.
    """

    target: Vector
    follows: str
    distance: float
    yaw: float
    pitch: float
    angle: float


@dataclass(frozen=True)
class Scenery:
    """All of it.

    Attributes:
        bodies: what moves.
        ground: beneath them.
        camera: in front of them.
    """

    bodies: tuple[Machine | Roll, ...]
    ground: Ground
    camera: Camera
