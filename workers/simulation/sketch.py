"""Flat pictures: what draws a step of a trajectory by itself, with lines, circles and polygons in metres.

Example:
    >>> def draw(canvas, state):
    ...     canvas.line([(-1, 0), (1, 0)], width=0.01, color="gray")
    ...     canvas.circle((state["x"], 0.1), radius=0.1, color="firebrick")
    >>> Sketch(draw, x=(-1, 1), y=(-0.2, 1)).picture({"x": 0.5}, 64, 48).shape
    (48, 64, 3)
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageOps

from workers.simulation.artist import Artist, State
from workers.simulation.scenery import Interval

PAPER = (244, 246, 248)
_FINER = 3  # pixels drawn along each side of one that is shown, to smooth edges

Point = Sequence[float]
"""It is a place in the plane: how far to the right, and how far up, in m."""
Color = str | tuple[int, int, int]
"""It is a name that Pillow knows, such as `steelblue` or `#4682b4`, or red, green and blue from 0 to 255."""


class Canvas:
    """A part of the plane to draw on, in m, to the right and up; it stands in the middle of the picture.

    Args:
        x: at least this extent is seen, in m.
        y: the same upwards.
        width: of the picture, in pixels.
        height: of the picture, in pixels.
    """

    def __init__(self, x: Interval, y: Interval, width: int, height: int) -> None:
        self._image = Image.new("RGB", (width * _FINER, height * _FINER), PAPER)
        self._pen = ImageDraw.Draw(self._image)
        self._scale = _FINER * min(width / (x[1] - x[0]), height / (y[1] - y[0]))
        self._left = (_FINER * width - self._scale * (x[0] + x[1])) / 2
        self._top = (_FINER * height + self._scale * (y[0] + y[1])) / 2

    def line(self, points: Sequence[Point], *, width: float, color: Color) -> None:
        """Draw straight lines from point to point, with round ends, as links and rods are.

        Args:
            points: at least one.
            width: in m; a line is always at least one pixel wide.
            color: of the line.
        """
        pixels = max(1, round(width * self._scale))
        self._pen.line([self._pixel(point) for point in points], fill=color, width=pixels)
        if pixels > _FINER:
            for point in points:
                self.circle(point, radius=width / 2, color=color)

    def polygon(self, corners: Sequence[Point], *, color: Color) -> None:
        """Fill a polygon.

        Args:
            corners: at least three.
            color: of the whole of it.
        """
        self._pen.polygon([self._pixel(corner) for corner in corners], fill=color)

    def box(self, center: Point, *, size: Point, angle: float = 0.0, color: Color) -> None:
        """Fill a rectangle.

        Args:
            center: of the rectangle.
            size: its width and its height before it is turned, in m.
            angle: that it is turned by, anticlockwise, in rad.
            color: of the whole of it.
        """
        cosine, sine = math.cos(angle), math.sin(angle)
        halves = [(i * size[0] / 2, j * size[1] / 2) for i, j in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        corners = [(center[0] + a * cosine - b * sine, center[1] + a * sine + b * cosine) for a, b in halves]
        self.polygon(corners, color=color)

    def circle(self, center: Point, *, radius: float, color: Color) -> None:
        """Fill a circle.

        Args:
            center: of the circle.
            radius: in m.
            color: of the whole of it.
        """
        self._pen.circle(self._pixel(center), radius * self._scale, fill=color)

    def picture(self) -> UInt8[np.ndarray, "height width 3"]:
        """All that was drawn, its edges smooth."""
        return np.asarray(self._image.reduce(_FINER))

    def _pixel(self, point: Point) -> tuple[float, float]:
        return self._left + self._scale * point[0], self._top - self._scale * point[1]


@dataclass(frozen=True)
class Sketch(Artist):
    """Flat pictures by a function of one's own.

    Attributes:
        draw: puts a step onto a canvas; what it draws later covers what it drew before.
        x: at least this extent of the plane is seen, in m, to the right.
        y: the same upwards.
    """

    draw: Callable[[Canvas, State], None]
    x: Interval
    y: Interval

    def __post_init__(self) -> None:
        """Refuse an empty part of the plane."""
        for name in ("x", "y"):
            low, high = getattr(self, name)
            if not (low < high and math.isfinite(high - low)):
                raise ValueError(f"{name} of a sketch must satisfy low < high, in m, got ({low}, {high})")

    def picture(self, state: State, width: int, height: int) -> UInt8[np.ndarray, "height width 3"]:
        """Let the function draw one step.

        Args:
            state: the step of ξ, by the names of its channels.
            width: in pixels.
            height: in pixels.

        Returns:
            Red, green and blue, from the top left, [height, width, 3].
        """
        canvas = Canvas(self.x, self.y, width, height)
        self.draw(canvas, state)
        return canvas.picture()


def fit(
    picture: UInt8[np.ndarray, "tall wide 3"], width: int, height: int
) -> UInt8[np.ndarray, "height width 3"]:
    """Scale a picture of any size until it just fits, and put it in the middle.

    Args:
        picture: red, green and blue.
        width: wanted, in pixels.
        height: wanted, in pixels.

    Returns:
        The picture between margins, nothing of it cut or stretched.
    """
    image = Image.fromarray(np.ascontiguousarray(picture))
    return np.asarray(ImageOps.pad(image, (width, height), Image.Resampling.LANCZOS, color=PAPER))
