"""The surfaces of a scene, against their areas."""

import math

import numpy as np
import pytest

from workers.simulation.scenery import Ground
from workers.simulation.shapes import cylinder, ground, numbers

COLORS = tuple((share, share, share) for share in (0.9, 0.8, 0.7, 0.6))
BLUE = (0.0, 0.0, 1.0)


def _area(surface) -> float:
    one, two, three = np.array(surface.vertices())[surface.indices()].reshape(-1, 3, 3).swapaxes(0, 1)
    return float(np.linalg.norm(np.cross(two - one, three - one), axis=1).sum() / 2)


def test_tiles_cover_the_ground_once_and_end_where_the_task_does():
    model = Ground(0.1, (0.0, 1.5), (-0.45, 0.45), numbered=())
    areas = {surface.color: _area(surface) for surface in ground(model, (-1.0, 2.0), (-1.0, 1.0), COLORS)}
    assert sum(areas.values()) == pytest.approx(3.0 * 2.0)
    assert areas[COLORS[0]] + areas[COLORS[1]] == pytest.approx(1.5 * 0.9)
    assert areas[COLORS[2]] == pytest.approx(areas[COLORS[3]], rel=0.05)


def test_a_walkway_without_end_fills_what_is_drawn():
    model = Ground(0.5, (-0.5, 0.5), (-math.inf, math.inf), numbered=())
    inside = ground(model, (-2.0, 2.0), (3.0, 5.0), COLORS)[:2]
    assert sum(map(_area, inside)) == pytest.approx(1.0 * 2.0)


def test_every_metre_is_numbered_at_its_place():
    model = Ground(0.5, (-0.5, 0.5), (-math.inf, math.inf), numbered=(0.5,))
    (ink,) = numbers(model, (-1.2, 1.2), BLUE)
    corners = np.array(ink.vertices())
    for metre in (-1, 0, 1):
        assert ((corners[:, 1] >= metre) & (corners[:, 1] <= metre + 0.25)).any()
    assert len(ink.quads) == (1 + 2) + 6 + 2  # strokes of a minus and a one, of a nought, and of a one
    assert corners[:, 0].min() > 0.5
    assert numbers(model, (0.2, 0.8), BLUE) == []


def test_a_cylinder_has_the_surface_of_one():
    radius, height = 0.08, 0.22
    area = sum(_area(part) for part in cylinder(radius, height, COLORS[:2]))
    assert area == pytest.approx(2 * math.pi * radius * (height + radius), rel=0.005)


def test_ground_without_extent_is_refused():
    with pytest.raises(ValueError, match=r"tile must be a length above 0 m, got 0\.0"):
        Ground(0.0, (0.0, 1.0), (0.0, 1.0), numbered=())
    with pytest.raises(ValueError, match="y of the ground must satisfy low < high"):
        Ground(0.1, (0.0, 1.0), (1.0, 0.0), numbered=())
