"""Pictures by an artist; tests/contracts holds those of sceneries."""

from dataclasses import replace

import numpy as np
import pytest

from workers import setups
from workers.environments.point import Point
from workers.pictures import Size, frames
from workers.simulation.artist import Artist
from workers.simulation.sketch import Sketch


class Told(Artist):
    """Draws nothing, remembers what it was told, and returns what it is given."""

    def __init__(self, picture=None) -> None:
        self._picture = picture
        self.states = []
        self.closed = 0

    def picture(self, state, width, height):
        self.states.append(state)
        return np.zeros((height, width, 3), np.uint8) if self._picture is None else self._picture

    def close(self) -> None:
        self.closed += 1


def drawn_by(artist):
    """A setup of three channels, drawn by that artist."""

    def build():
        point = Point(3)
        point.scenery = artist
        return point

    quadratic = setups.load("quadratic-30d")
    return replace(quadratic, build=build, observation=Point(3).observation)


XI = np.arange(12, dtype=np.float32).reshape(3, 4)


def test_an_artist_is_told_the_channels_by_name_in_the_steps_asked_for():
    artist = Told()
    pictures = list(frames(drawn_by(artist), XI, [3, 0], Size(64, 48)))
    assert [picture.shape for picture in pictures] == [(48, 64, 3)] * 2
    assert artist.states == [{"x1": 3.0, "x2": 7.0, "x3": 11.0}, {"x1": 0.0, "x2": 4.0, "x3": 8.0}]
    assert artist.closed == 1


def test_an_artist_is_closed_when_its_pictures_are_left_before_the_end():
    artist = Told()
    pictures = frames(drawn_by(artist), XI, [0, 1, 2], Size(64, 48))
    next(pictures)
    assert artist.closed == 0
    pictures.close()
    assert artist.closed == 1


def test_a_sketch_is_drawn_like_a_scenery():
    def draw(canvas, state):
        canvas.circle((state["x1"], 0.0), radius=0.3, color="red")

    first, last = frames(drawn_by(Sketch(draw, (-1.0, 4.0), (-1.0, 1.0))), XI, [0, 3], Size(64, 48))
    assert (first != last).any()


@pytest.mark.parametrize(
    "picture",
    [np.zeros((64, 48, 3), np.uint8), np.zeros((48, 64, 3)), np.zeros((48, 64), np.uint8), [1, 2, 3]],
)
def test_what_is_no_picture_of_the_size_asked_for_is_refused_with_a_remedy(picture):
    with pytest.raises(ValueError, match=r"Told\.picture must return uint8 of shape \(48, 64, 3\).*fit fits"):
        list(frames(drawn_by(Told(picture)), XI, [0], Size(64, 48)))
