"""Clips of the controllers on which two simulations disagree most, side by side."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from cluster.errors import UsageError
from cluster.files import replacing
from cluster.inputs import usage_errors
from cluster.progress import ProgressLine, say
from cluster.rendering.frames import add_title, clip, pictures, usual_speed
from cluster.rendering.video import Picture, write
from workers.collection.twins import Twins
from workers.episode import Episode
from workers.pictures import Size, scenery_of
from workers.setups import Setup

_SIZE = Size(280, 210)
_RATE = 8  # pictures per second
_SEAM = 4  # pixels


def draw_worst(
    out: Path, setups: tuple[Setup, Setup], names: tuple[str, str], pairs: Sequence[Twins]
) -> list[str]:
    """Draw the same controllers in both simulations.

    Args:
        out: folder of the clips.
        setups: the one and the other.
        names: of them, as written above the pictures.
        pairs: the controllers, the worst first.

    Returns:
        Names of the files; none where there is nothing to see, which is said.
    """
    try:
        with usage_errors():
            for setup in setups:
                scenery_of(setup)
    except UsageError as error:
        say(f"no clips: {error}")
        return []
    paths = [out / f"worst-{number}.gif" for number in range(1, len(pairs) + 1)]
    with ProgressLine("clips", len(pairs), 0) as progress:
        for path, pair in zip(paths, pairs, strict=True):
            rows = zip(setups, names, (pair.one, pair.other), strict=True)
            with replacing(path) as unfinished:
                write(unfinished, path.suffix, _beside(*(_pictures_of(*row) for row in rows)), _RATE)
            progress.advance(1, "")
    return [path.name for path in paths]


def _pictures_of(setup: Setup, name: str, episode: Episode) -> Iterator[Picture]:
    moments = clip(setup, episode, usual_speed(setup), _RATE)
    title = f"{name}: f {episode.f:+.3g}, y {episode.y:.2f}"
    for picture in pictures(setup, episode, moments, _SIZE, ""):
        yield add_title(picture, title)


def _beside(left: Iterator[Picture], right: Iterator[Picture]) -> Iterator[Picture]:
    """Side by side, as long as both last: a clip of another horizon may be shorter."""
    for one, other in zip(left, right, strict=False):
        seam = np.full((one.shape[0], _SEAM, 3), 255, dtype=np.uint8)
        yield np.concatenate([one, seam, other], axis=1)
