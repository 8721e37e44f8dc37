"""Pictures in the files of each format."""

from fractions import Fraction

import numpy as np
import pytest
from PIL import Image

WIDTH, HEIGHT = 64, 48


@pytest.fixture
def stripes():
    """Pictures that differ: a bright column moves to the right over a dark ground."""
    made = np.full((5, HEIGHT, WIDTH, 3), 40, dtype=np.uint8)
    for number, picture in enumerate(made):
        picture[:, 10 * number : 10 * number + 8] = (200, 120, 30)
    return list(made)


def test_a_gif_opens_again_with_every_picture_in_its_place(stripes, tmp_path):
    from cluster.rendering.video import write

    write(tmp_path / "clip.gif", ".gif", iter(stripes), 10)
    with Image.open(tmp_path / "clip.gif") as clip:
        assert (clip.size, clip.n_frames) == ((WIDTH, HEIGHT), 5)
        durations = []
        for number, picture in enumerate(stripes):
            clip.seek(number)
            durations.append(clip.info["duration"])
            difference = np.asarray(clip.convert("RGB")).astype(int) - picture
            assert np.abs(difference).max() <= 2
    assert durations == [100, 100, 100, 100, 1100]


def test_a_png_holds_the_stills_in_rows_without_loss(stripes, tmp_path):
    from cluster.rendering.video import write

    write(tmp_path / "strip.png", ".png", iter(stripes), 10)
    with Image.open(tmp_path / "strip.png") as image:
        strip = np.asarray(image)
    assert strip.shape == (2 * HEIGHT, 3 * WIDTH, 3)
    assert (strip[:HEIGHT, WIDTH : 2 * WIDTH] == stripes[1]).all()
    assert (strip[HEIGHT:, :WIDTH] == stripes[3]).all()
    assert (strip[HEIGHT:, 2 * WIDTH :] == 255).all()


def test_an_mp4_opens_again_with_every_picture_and_its_rate(stripes, tmp_path):
    av = pytest.importorskip("av")
    from cluster.rendering.video import HOLD, write

    write(tmp_path / "clip.mp4", ".mp4", iter(stripes), 10)
    with av.open(str(tmp_path / "clip.mp4")) as container:
        stream = container.streams.video[0]
        assert stream.average_rate == Fraction(10)
        decoded = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(decoded) == len(stripes) + HOLD * 10
    for picture, frame in zip(stripes, decoded[: len(stripes)], strict=True):
        assert np.abs(frame.astype(int) - picture).mean() < 6
