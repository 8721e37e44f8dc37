"""Surfaces to look at, as triangles: a ground of tiles, and a cylinder whose stripes show how it rolls."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from workers.simulation.scenery import Ground, Interval

Point = tuple[float, float, float]

SIDES = 48  # of the polygon that stands for a circle
STRIPES = 2
_WIDE, _HIGH, _THICK, _GAP = 0.12, 0.22, 0.03, 0.05  # m, of a digit on the ground
_ABOVE = 0.003  # m; at the ground's own height it would flicker
_MIDDLE = (_HIGH - _THICK) / 2
_STROKES = {  # left, right, near and far end of the seven segments of a digit
    "a": (0.0, _WIDE, _HIGH - _THICK, _HIGH),
    "b": (_WIDE - _THICK, _WIDE, _MIDDLE, _HIGH),
    "c": (_WIDE - _THICK, _WIDE, 0.0, _MIDDLE + _THICK),
    "d": (0.0, _WIDE, 0.0, _THICK),
    "e": (0.0, _THICK, 0.0, _MIDDLE + _THICK),
    "f": (0.0, _THICK, _MIDDLE, _HIGH),
    "g": (0.0, _WIDE, _MIDDLE, _MIDDLE + _THICK),
}
_SEGMENTS = {
    **{"-": "g", "0": "abcdef", "1": "bc", "2": "abged", "3": "abgcd", "4": "fgbc"},
    **{"5": "afgcd", "6": "afgedc", "7": "abc", "8": "abcdefg", "9": "abfgcd"},
}


class Quad(NamedTuple):
    """Four corners in m, anticlockwise as seen from outside, and the normal at each."""

    corners: tuple[Point, Point, Point, Point]
    normals: tuple[Point, Point, Point, Point]


class Surface(NamedTuple):
    """Quads of one colour (red, green, blue, from 0 to 1)."""

    color: Point
    quads: tuple[Quad, ...]

    def vertices(self) -> list[Point]:
        """The corners of all quads."""
        return [corner for quad in self.quads for corner in quad.corners]

    def normals(self) -> list[Point]:
        """Those of the vertices."""
        return [normal for quad in self.quads for normal in quad.normals]

    def indices(self) -> list[int]:
        """Two triangles for every quad."""
        return [4 * number + corner for number in range(len(self.quads)) for corner in (0, 1, 2, 0, 2, 3)]


def ground(
    model: Ground, x: Interval, y: Interval, colors: tuple[Point, Point, Point, Point]
) -> list[Surface]:
    """Lay the part of a ground over a rectangle; tiles are cut where its lighter part ends.

    Args:
        model: the ground.
        x: at least this extent, in m.
        y: the same along y.
        colors: of both kinds of tiles where the task happens, then of both elsewhere.

    Returns:
        One surface for each colour that occurs.
    """
    quads: tuple[list[Quad], ...] = ([], [], [], [])
    columns = list(pairwise(_cuts(model.tile, x, model.x)))
    rows = list(pairwise(_cuts(model.tile, y, model.y)))
    for left, right in columns:
        for near, far in rows:
            middle = (left + right) / 2, (near + far) / 2
            inside = model.x[0] < middle[0] < model.x[1] and model.y[0] < middle[1] < model.y[1]
            odd = sum(math.floor(m / model.tile) for m in middle) % 2
            quads[odd if inside else 2 + odd].append(flat(left, right, near, far, 0.0))
    return [Surface(color, tuple(part)) for color, part in zip(colors, quads, strict=True) if part]


def flat(left: float, right: float, near: float, far: float, height: float) -> Quad:
    """Make a horizontal rectangle that is seen from above.

    Args:
        left: least x, in m.
        right: greatest x, in m.
        near: least y, in m.
        far: greatest y, in m.
        height: z, in m.

    Returns:
        The rectangle, its normals along +z.
    """
    up = (0.0, 0.0, 1.0)
    corners = (left, near, height), (right, near, height), (right, far, height), (left, far, height)
    return Quad(corners, (up, up, up, up))


def numbers(model: Ground, y: Interval, color: Point) -> list[Surface]:
    """Write every whole metre of y on the ground, to be read by one who looks along +y.

    Args:
        model: the ground, which says where along x.
        y: from where to where, in m.
        color: of the digits.

    Returns:
        One surface with all digits; none where nothing is to be written.
    """
    metres = range(math.ceil(y[0]), math.floor(y[1]) + 1)
    places = [(metre, x) for metre in metres for x in model.numbered]
    quads = [quad for metre, x in places for quad in _write(str(metre), x, float(metre))]
    return [Surface(color, tuple(quads))] if quads else []


def _write(text: str, x: float, y: float) -> Iterator[Quad]:
    for place, character in enumerate(text):
        begin = x + _GAP + place * (_WIDE + _GAP)
        for segment in _SEGMENTS[character]:
            left, right, near, far = _STROKES[segment]
            yield flat(begin + left, begin + right, y + near, y + far, _ABOVE)


def _cuts(tile: float, extent: Interval, marks: Interval) -> list[float]:
    first, last = math.floor(extent[0] / tile), math.ceil(extent[1] / tile)
    edges = {tile * number for number in range(first, last + 1)}
    edges |= {mark for mark in marks if first * tile < mark < last * tile}
    return sorted(edges)


def cylinder(radius: float, height: float, colors: tuple[Point, Point]) -> list[Surface]:
    """Make an upright cylinder about the origin, its side in stripes of two colours.

    Args:
        radius: in m.
        height: in m.
        colors: of the stripes, in turn.

    Returns:
        One surface for each colour.
    """
    quads: tuple[list[Quad], list[Quad]] = ([], [])
    angles = np.linspace(0.0, 2 * math.pi, SIDES + 1).tolist()
    for number, (one, other) in enumerate(pairwise(angles)):
        stripe = number * 2 * STRIPES // SIDES % 2
        quads[stripe].append(_side(one, other, radius, height))
        quads[stripe].extend(_lids(one, other, radius, height))
    return [Surface(color, tuple(part)) for color, part in zip(colors, quads, strict=True)]


def _side(one: float, other: float, radius: float, height: float) -> Quad:
    (a, b), (c, d) = (math.cos(one), math.sin(one)), (math.cos(other), math.sin(other))
    low, high = -height / 2, height / 2
    corners = (
        (radius * a, radius * b, low),
        (radius * c, radius * d, low),
        (radius * c, radius * d, high),
        (radius * a, radius * b, high),
    )
    return Quad(corners, ((a, b, 0.0), (c, d, 0.0), (c, d, 0.0), (a, b, 0.0)))


def _lids(one: float, other: float, radius: float, height: float) -> Iterator[Quad]:
    for end, (first, second) in ((1.0, (one, other)), (-1.0, (other, one))):
        middle, up = (0.0, 0.0, end * height / 2), (0.0, 0.0, end)
        rim = [(radius * math.cos(angle), radius * math.sin(angle), middle[2]) for angle in (first, second)]
        yield Quad((middle, rim[0], rim[1], middle), (up, up, up, up))
