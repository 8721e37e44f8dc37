"""`svaedc render`: an episode, rolled out and drawn into one file."""

from dataclasses import dataclass
from pathlib import Path

from cluster.files import replacing
from cluster.progress import say
from cluster.rendering.episodes import episode_to_draw
from cluster.rendering.frames import clip, drawable, pictures, stills, summary, usual_speed, with_progress
from cluster.rendering.model_frames import beside
from cluster.rendering.video import STILLS, write
from workers.physics import Physics
from workers.setups import Setup


@dataclass(frozen=True)
class Drawing:
    """How an episode is drawn.

    Attributes:
        out: the file: a clip, .gif or .mp4, or stills, .png.
        width: pixels of each drawing.
        height: pixels of each drawing.
        speed: of a clip, 1 is as fast as life; None for one that lasts 5 to 8 s.
        fps: pictures per second of a clip.
        stills: pictures of a .png.
    """

    out: Path
    width: int
    height: int
    speed: float | None
    fps: int
    stills: int


def render(setup: Setup, x: str, physics: Physics | None, drawing: Drawing, model: Path | None) -> None:
    """Roll out an episode, draw it, and say what is seen.

    Args:
        setup: whose episode.
        x: its controller, in one of the forms of `cluster.rendering.episodes.FORMS`.
        physics: of the episode; None for those of the dataset's episode, or nominal ones.
        drawing: how it is drawn.
        model: folder of a model that reconstructs and generates the episode beside it; None for none.

    Raises:
        UsageError: the controller, a size or the kind of file is none.
        UserError: the dataset or the model cannot be read.
    """
    out = drawing.out
    size = drawable(setup, out, drawing.width, drawing.height)
    pace = usual_speed(setup) if drawing.speed is None else drawing.speed
    episode = episode_to_draw(x, setup, physics)
    if out.suffix in STILLS:
        moments, note = stills(setup, episode, drawing.stills), setup.name
    else:
        moments, note = clip(setup, episode, pace, drawing.fps), f"{setup.name} {pace:.2g}x"
    if model is None:
        drawn = with_progress(pictures(setup, episode, moments, size, note), len(moments))
    else:
        drawn = beside(setup, episode, model, moments, size, out.suffix)
    out.parent.mkdir(parents=True, exist_ok=True)
    with replacing(out) as unfinished:
        write(unfinished, out.suffix, drawn, drawing.fps)
    say(summary(setup, episode))
    say(f"wrote {out}: {len(moments)} pictures, {out.stat().st_size / 1e3:.0f} kB")
