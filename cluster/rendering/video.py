"""Pictures in a file: a GIF or MP4 that moves, or a PNG of stills in rows."""

from collections.abc import Iterator, Sequence
from itertools import chain
from pathlib import Path

import numpy as np
from jaxtyping import UInt8
from PIL import Image

from cluster.errors import UsageError

Picture = UInt8[np.ndarray, "height width 3"]

STILLS, CLIPS = (".png",), (".gif", ".mp4")
PER_ROW = 3
COLORS = 64  # of a GIF; more cost space and are hardly seen
HOLD = 1  # s that the last picture of a clip stays
_SAMPLES = 16  # pictures that a GIF's colours are chosen from


def require_writable(path: Path, width: int, height: int) -> None:
    """Refuse a file of a kind that cannot be written here, before any work is done.

    Args:
        path: of the file.
        width: of each picture, in pixels.
        height: of each picture, in pixels.

    Raises:
        UsageError: naming the kinds, or the library that is missing.
    """
    if path.suffix not in (*STILLS, *CLIPS):
        raise UsageError(f"--out must end in .gif, .mp4 or .png, got {path.name}")
    if path.suffix == ".mp4":
        if width % 2 or height % 2:
            raise UsageError(f"an .mp4 needs an even width and height, got {width} × {height}")
        try:
            import av  # noqa: F401
        except ImportError as error:
            raise UsageError(
                "an .mp4 needs PyAV, which is not installed: pip install -c constraints.txt -e '.[video]', "
                "or ask for a .gif"
            ) from error


def write(path: Path, kind: str, pictures: Iterator[Picture], rate: int) -> None:
    """Write pictures of one size; the last one of a clip stays for a second.

    Args:
        path: of the file.
        kind: .gif, .mp4 or .png.
        pictures: at least one.
        rate: pictures per second of a clip; a GIF rounds their duration to 10 ms.
    """
    if kind == ".gif":
        _write_gif(path, list(pictures), rate)
    elif kind == ".mp4":
        _write_mp4(path, pictures, rate)
    else:
        Image.fromarray(mosaic(list(pictures), PER_ROW)).save(path, format="PNG", optimize=True)


def mosaic(pictures: Sequence[Picture], columns: int) -> UInt8[np.ndarray, "tall wide 3"]:
    """Arrange pictures in rows, from the top left.

    Args:
        pictures: at least one, all of one size.
        columns: pictures in a row, at most.

    Returns:
        One picture; places left over are white.
    """
    height, width, _ = pictures[0].shape
    rows = -(-len(pictures) // columns)
    columns = min(columns, len(pictures))
    whole = np.full((rows * height, columns * width, 3), 255, dtype=np.uint8)
    for number, picture in enumerate(pictures):
        top, left = number // columns * height, number % columns * width
        whole[top : top + height, left : left + width] = picture
    return whole


def _write_gif(path: Path, pictures: Sequence[Picture], rate: int) -> None:
    """One palette for all pictures and no dithering, so that only what moves takes space."""
    chosen = np.linspace(0, len(pictures) - 1, min(_SAMPLES, len(pictures))).astype(int)
    sample = Image.fromarray(mosaic([pictures[number] for number in chosen], 4))
    palette = sample.quantize(COLORS, method=Image.Quantize.MEDIANCUT)
    first, *rest = (
        Image.fromarray(picture).quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures
    )
    each = 10 * round(100 / rate)
    durations = [each] * len(rest) + [each + 1000 * HOLD]
    first.save(path, format="GIF", save_all=True, append_images=rest, duration=durations, loop=0)


def _write_mp4(path: Path, pictures: Iterator[Picture], rate: int) -> None:
    import av

    first = next(pictures)
    with av.open(str(path), "w", format="mp4") as container:
        stream = container.add_stream("libx264", rate=rate, options={"crf": "24"})
        stream.height, stream.width, _ = first.shape
        stream.pix_fmt = "yuv420p"
        for picture in chain([first], pictures):
            frame = av.VideoFrame.from_ndarray(picture, format="rgb24")
            container.mux(stream.encode(frame))
        for _ in range(HOLD * rate):
            container.mux(stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")))
        container.mux(stream.encode())
