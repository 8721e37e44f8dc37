"""What is written on the pictures of an episode: the time, and the bad conditions within a red border."""

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

RED = (206, 32, 41)
TITLE = 20  # pixels; even, as an .mp4 asks
_INK, _PAPER = (20, 24, 32), (250, 250, 250)


def captioned(
    picture: UInt8[np.ndarray, "height width 3"], corner: str, note: str, conditions: tuple[str, ...]
) -> UInt8[np.ndarray, "height width 3"]:
    """A copy of the picture with text on it.

    Args:
        picture: red, green and blue.
        corner: written at the top left.
        note: written at the top right.
        conditions: the bad conditions that hold, written at the bottom; any of them draws the border.
    """
    image = Image.fromarray(picture)
    draw = ImageDraw.Draw(image)
    width, height = image.size
    edge = max(2, height // 70)
    near = 2 * edge + 2
    _write(draw, (near, near), "la", corner, _INK)
    _write(draw, (width - near, near), "ra", note, _INK)
    if conditions:
        draw.rectangle((0, 0, width - 1, height - 1), outline=RED, width=edge)
        _write(draw, (near, height - near), "ld", ", ".join(conditions).replace("_", " "), RED)
    return np.asarray(image)


def headed(picture: UInt8[np.ndarray, "height width 3"], title: str) -> UInt8[np.ndarray, "taller width 3"]:
    """The picture below a white strip with a title, which is cut where it is wider."""
    font = ImageFont.load_default(TITLE // 2 + 2)
    strip = Image.new("RGB", (picture.shape[1], TITLE), _PAPER)
    ImageDraw.Draw(strip).text((4, TITLE // 2), title, fill=_INK, font=font, anchor="lm")
    return np.concatenate([np.asarray(strip), picture])


def _write(
    draw: ImageDraw.ImageDraw, place: tuple[int, int], anchor: str, text: str, colour: tuple[int, int, int]
) -> None:
    font = ImageFont.load_default(max(11, draw.im.size[1] // 18))
    draw.text(place, text, fill=colour, font=font, anchor=anchor, stroke_width=1, stroke_fill=_PAPER)
