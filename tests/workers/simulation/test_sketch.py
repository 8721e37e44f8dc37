"""Flat pictures: what is drawn in metres stands where it should in pixels."""

import numpy as np
import pytest

from workers.simulation.sketch import PAPER, Canvas, Sketch, fit

RED = (255, 0, 0)


def canvas() -> Canvas:
    """Four metres by two around (1, 0), 10 pixels each metre."""
    return Canvas((-1.0, 3.0), (-1.0, 1.0), 40, 20)


def red(picture) -> list[tuple[int, int]]:
    """Rows and columns of the pixels that are wholly red."""
    return [tuple(place) for place in np.argwhere((picture == RED).all(axis=2)).tolist()]


def test_a_box_fills_its_metres_and_nothing_else():
    drawing = canvas()
    drawing.box((0.0, 0.5), size=(0.4, 0.2), color="red")  # columns 8 to 11, rows 4 and 5
    picture = drawing.picture()
    assert picture.shape == (20, 40, 3)
    middle = set(red(picture))
    assert {(4, 9), (4, 10), (5, 9), (5, 10)} <= middle
    assert all(3 <= row <= 6 and 7 <= column <= 12 for row, column in middle)
    assert (picture[10:] == PAPER).all()


def test_a_turned_box_stands_as_one_drawn_upright():
    turned, upright = canvas(), canvas()
    turned.box((1.0, 0.0), size=(1.6, 0.4), angle=np.pi / 2, color="red")
    upright.box((1.0, 0.0), size=(0.4, 1.6), color="red")
    assert np.abs(turned.picture().astype(int) - upright.picture()).mean() < 3.0
    assert len(red(turned.picture())) > 30


def test_up_is_up_and_right_is_right():
    drawing = canvas()
    drawing.circle((2.5, 0.7), radius=0.2, color="red")
    rows, columns = np.transpose(red(drawing.picture()))
    assert rows.mean() == pytest.approx(3, abs=0.6)
    assert columns.mean() == pytest.approx(35, abs=0.6)


def test_a_line_has_the_width_of_its_metres_and_round_ends():
    drawing = canvas()
    drawing.line([(0.0, 0.0), (2.0, 0.0)], width=0.6, color="red")
    picture = drawing.picture()
    assert len([place for place in red(picture) if place[1] == 20]) in (5, 6, 7)
    ends = [column for row, column in red(picture) if row in (9, 10)]
    assert min(ends) <= 8  # half a width beyond the first point, which is in column 10
    assert max(ends) >= 31


def test_a_thin_line_is_seen_all_the_same():
    drawing = canvas()
    drawing.line([(-1.0, 0.0), (3.0, 0.0)], width=1e-6, color="red")
    assert (drawing.picture() != PAPER).any()


def test_metres_are_as_long_upwards_as_sideways_whatever_the_size():
    drawing = Canvas((-1.0, 1.0), (-1.0, 1.0), 60, 30)
    drawing.circle((0.0, 0.0), radius=0.9, color="red")
    rows, columns = np.transpose(red(drawing.picture()))
    assert np.ptp(rows) == pytest.approx(np.ptp(columns), abs=1)
    assert (rows.mean(), columns.mean()) == (pytest.approx(14.5, abs=0.6), pytest.approx(29.5, abs=0.6))


def test_a_sketch_shows_the_state_that_it_is_given():
    def draw(canvas, state):
        canvas.circle((state["x"], 0.0), radius=0.2, color="red")

    sketch = Sketch(draw, x=(-1.0, 1.0), y=(-1.0, 1.0))
    left, right = (sketch.picture({"x": x}, 64, 48) for x in (-0.5, 0.5))
    assert (left[:, ::-1] == right).mean() > 0.99
    assert (left != right).any()


@pytest.mark.parametrize("extent", [(1.0, 1.0), (2.0, 1.0), (float("nan"), 1.0), (0.0, float("inf"))])
def test_a_part_of_the_plane_without_extent_is_refused(extent):
    with pytest.raises(ValueError, match="x of a sketch must satisfy low < high"):
        Sketch(print, x=extent, y=(0.0, 1.0))


@pytest.mark.parametrize("shape", [(10, 40, 3), (40, 10, 3), (480, 480, 3)])
def test_a_picture_of_any_size_is_fitted_whole_between_margins(shape):
    whole = fit(np.full(shape, RED, dtype=np.uint8), 60, 30)
    assert whole.shape == (30, 60, 3)
    rows, columns = np.transpose(red(whole))
    height, width = np.ptp(rows) + 1, np.ptp(columns) + 1
    assert width / height == pytest.approx(shape[1] / shape[0], rel=0.15)
    assert height >= 29 or width >= 59
