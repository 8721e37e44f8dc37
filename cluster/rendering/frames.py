"""The pictures of an episode: which moments are shown, and what is written on them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image, ImageDraw, ImageFont

from cluster.errors import UsageError
from cluster.inputs import usage_errors
from cluster.progress import ProgressLine
from cluster.rendering.video import Picture, require_writable
from workers.episode import Episode
from workers.pictures import Size, frames, scenery_of
from workers.setups import Setup

RED = (206, 32, 41)
TITLE = 20  # pixels; even, as an .mp4 asks
_INK, _PAPER = (20, 24, 32), (250, 250, 250)


def caption(
    picture: UInt8[np.ndarray, "height width 3"], corner: str, note: str, conditions: tuple[str, ...]
) -> UInt8[np.ndarray, "height width 3"]:
    """Write text on a picture.

    Args:
        picture: red, green and blue.
        corner: written at the top left.
        note: written at the top right.
        conditions: the bad conditions that hold, written at the bottom; any of them draws the border.

    Returns:
        A copy of the picture with the text on it.
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


def add_title(
    picture: UInt8[np.ndarray, "height width 3"], title: str
) -> UInt8[np.ndarray, "taller width 3"]:
    """Put a picture below a white strip with a title.

    Args:
        picture: red, green and blue.
        title: cut where it is wider than the picture.

    Returns:
        The whole, `TITLE` pixels taller.
    """
    font = ImageFont.load_default(TITLE // 2 + 2)
    strip = Image.new("RGB", (picture.shape[1], TITLE), _PAPER)
    ImageDraw.Draw(strip).text((4, TITLE // 2), title, fill=_INK, font=font, anchor="lm")
    return np.concatenate([np.asarray(strip), picture])


def _write(
    draw: ImageDraw.ImageDraw, place: tuple[int, int], anchor: str, text: str, color: tuple[int, int, int]
) -> None:
    font = ImageFont.load_default(max(11, draw.im.size[1] // 18))
    draw.text(place, text, fill=color, font=font, anchor=anchor, stroke_width=1, stroke_fill=_PAPER)


SHORTEST, LONGEST = 5.0, 8.0  # s of a clip whose speed nobody chose


@dataclass(frozen=True)
class Moment:
    """One picture: the step it shows, and the bad conditions written on it."""

    step: int
    conditions: tuple[str, ...]


def drawable(setup: Setup, out: Path, width: int, height: int) -> Size:
    """Make sure that there is something to see, and that it can be written.

    Args:
        setup: what is drawn.
        out: file of the pictures; its suffix is the kind.
        width: of each picture, in pixels.
        height: of each picture, in pixels.

    Returns:
        The size of each picture.

    Raises:
        UsageError: the size or the kind of the file is impossible, or there is nothing to see.
    """
    try:
        size = Size(width, height)
    except ValueError as error:
        raise UsageError(f"{error}; change --width or --height") from error
    require_writable(out, width, height)
    with usage_errors():
        scenery_of(setup)
    return size


def usual_speed(setup: Setup) -> float:
    """That of life if a clip then lasts 5 to 8 s, and the nearest that makes it so otherwise."""
    seconds = setup.horizon * setup.control_step
    return seconds / min(max(seconds, SHORTEST), LONGEST)


def clip(setup: Setup, episode: Episode, speed: float, rate: int) -> list[Moment]:
    """Choose the moments of a clip, evenly over an episode.

    Args:
        setup: of the episode.
        episode: the episode.
        speed: 1 is that of life.
        rate: pictures per second.

    Returns:
        The moments in order; each tells every condition that held since the one before.

    Raises:
        UsageError: the speed is no positive number, or asks for more pictures than the episode has steps.
    """
    slowest = rate * setup.control_step
    if not (math.isfinite(speed) and speed >= slowest):
        raise UsageError(
            f"--speed must be at least {slowest:.3g} with --fps {rate}, got {speed:g}: "
            f"{setup.name} has no more than {setup.horizon} steps to show"
        )
    count = max(1, round(setup.horizon * slowest / speed))
    edges = np.rint(np.linspace(0, setup.horizon, count + 1)).astype(int)
    return [
        Moment(stop - 1, conditions_in(setup, episode.bad[start:stop]))
        for start, stop in pairwise(edges.tolist())
    ]


def stills(setup: Setup, episode: Episode, count: int) -> list[Moment]:
    """Choose the moments of stills, evenly over an episode.

    Args:
        setup: of the episode.
        episode: the episode.
        count: how many, at least 1.

    Returns:
        The moments in order, from the first step to the last; each tells what holds just then.
    """
    steps = np.rint(np.linspace(0, setup.horizon - 1, count)).astype(int).tolist()
    return [Moment(step, conditions_in(setup, episode.bad[step : step + 1])) for step in steps]


def pictures(
    setup: Setup, episode: Episode, moments: Sequence[Moment], size: Size, note: str
) -> Iterator[Picture]:
    """Draw moments of an episode.

    Args:
        setup: of the episode.
        episode: the episode.
        moments: to draw.
        size: of each picture.
        note: written at the top right.

    Yields:
        A picture of each moment, with time, conditions and the note written on it.
    """
    drawn = frames(setup, episode.xi, [moment.step for moment in moments], size)
    for moment, picture in zip(moments, drawn, strict=True):
        corner = f"{(moment.step + 1) * setup.control_step:.2f} s"
        yield caption(picture, corner, note, moment.conditions)


def with_progress(drawn: Iterator[Picture], count: int) -> Iterator[Picture]:
    """Say how far the drawing is.

    Args:
        drawn: pictures.
        count: how many there will be.

    Yields:
        The same pictures.
    """
    with ProgressLine("pictures", count, 0) as progress:
        for picture in drawn:
            yield picture
            progress.advance(1, "")


def conditions_in(setup: Setup, bad: np.ndarray) -> tuple[str, ...]:
    """Tell which bad conditions hold in any of some steps.

    Args:
        setup: whose conditions they are.
        bad: of at least one step, [n]: bits of the conditions, or degrees in [0, 1] where G_bad is graded.

    Returns:
        Their names; a graded one comes with its greatest degree.
    """
    if bad.dtype == np.float32:
        degree = float(bad.max())
        return (f"{setup.conditions[0]} {degree:.0%}",) if degree > 0.0 else ()
    bits = int(np.bitwise_or.reduce(bad))
    return tuple(name for number, name in enumerate(setup.conditions) if bits >> number & 1)


def summary(setup: Setup, episode: Episode) -> str:
    """Sum an episode up in one line.

    Args:
        setup: of the episode.
        episode: the episode.

    Returns:
        Objective, badness, which conditions made it, and why the episode stopped.
    """
    reasons = conditions_in(setup, episode.bad)
    stopped = f"; stopped: {episode.stop}" if episode.stop else ""
    because = f" ({', '.join(reasons)})" if reasons else ""
    return f"{setup.name}: objective {episode.f:+.3g}, badness {episode.y:.2f}{because}{stopped}"
