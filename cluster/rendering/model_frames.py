"""Episodes and what a model makes of them: original, reconstructed and generated, each with its badness."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from jaxtyping import UInt8

from cluster.errors import UsageError, UserError
from cluster.files import replacing
from cluster.inputs import setup_of
from cluster.optimization.models import trained_model
from cluster.progress import ProgressLine, say
from cluster.rendering.frames import Moment, add_title, caption, stills, summary
from cluster.rendering.video import STILLS, Picture, mosaic, write
from svaedc.model.reconstruction import Reconstruction, reconstructions, remarkable
from svaedc.model.svae_dc import SvaeDc
from workers.dataset.cache import TrainingCache
from workers.dataset.folder import Dataset
from workers.episode import Episode, degrees, stride_steps
from workers.pictures import Size, frames, scenery_of
from workers.setups import Setup

ACROSS = 2  # blocks beside each other
GAP = 6  # pixels
DOWN = 3  # moments below each other in a block of stills
SMALL = Size(160, 120)
RATE = 4  # pictures per second of the clip that a training leaves


@dataclass(frozen=True)
class ModelView:
    """An episode and what a model makes of it.

    Attributes:
        title: written above.
        episode: as it was recorded.
        told: by the model, at its training stride.
        stride: control steps between two of the model's.
    """

    title: str
    episode: Episode
    told: tuple[Reconstruction, ...]
    stride: int


def model_view(title: str, episode: Episode, model: SvaeDc, stride: int) -> ModelView:
    """Let a model reconstruct an episode, and generate it from its controller.

    Args:
        title: written above.
        episode: with all control steps.
        model: in evaluation mode.
        stride: control steps between two of the model's.

    Returns:
        The episode, and what the model makes of it.

    Raises:
        ValueError: the episode is not of the sizes that the model was trained on.
    """
    steps = stride_steps(episode.xi.shape[1], stride)
    found = (len(episode.x), len(episode.xi), len(range(episode.xi.shape[1])[steps]))
    config = model.config
    expected = (config.controller_dim, config.observation_dim, config.time_steps)
    if found != expected:
        raise ValueError(
            f"the model takes controllers, channels and steps of sizes {expected}, this episode has {found}: "
            "name a model that was trained on this setup"
        )
    xi, bad = episode.xi[:, steps], degrees(episode.bad[steps])
    return ModelView(title, episode, reconstructions(model, episode.x, xi, bad, episode.y), stride)


def strips(setup: Setup, shown: ModelView, moments: Sequence[Moment], size: Size) -> Iterator[Picture]:
    """Draw original, reconstruction and generation of an episode side by side.

    Args:
        setup: of the episode.
        shown: the episode, and what the model makes of it.
        moments: to draw.
        size: of each picture of a strip.

    Yields:
        A strip for each moment.
    """
    slow = replace(setup, control_step=setup.control_step * shown.stride)
    last = shown.told[0].xi.shape[1] - 1
    at = [moment.step for moment in moments]
    # The model's sample s stands for the last step of stride s.
    told_at = [min(max((step + 1) // shown.stride - 1, 0), last) for step in at]
    columns = [
        frames(setup, shown.episode.xi, at, size),
        *(frames(slow, told.xi, told_at, size) for told in shown.told),
    ]
    for moment, original, *told in zip(moments, *columns, strict=True):
        seconds = (moment.step + 1) * setup.control_step
        note = badness_note(shown.episode.y)
        panels = [caption(original, f"original {seconds:.2f} s", note, moment.conditions)]
        for picture, reconstruction in zip(told, shown.told, strict=True):
            panels.append(caption(picture, reconstruction.name, badness_note(reconstruction.y), ()))
        yield mosaic(panels, len(panels))


def board(titles: Sequence[str], blocks: Sequence[Sequence[Picture]]) -> UInt8[np.ndarray, "tall wide 3"]:
    """Arrange blocks of strips in rows of two, each below its title and apart from the next.

    Args:
        titles: one for each block.
        blocks: strips that stand below each other; all blocks have as many, all strips one size.

    Returns:
        One picture; a place left over is white.
    """
    margin = ((0, 0), (0, GAP), (0, 0))
    apart = [
        np.pad(add_title(mosaic(block, 1), title), margin, constant_values=255)
        for title, block in zip(titles, blocks, strict=True)
    ]
    return mosaic(apart, ACROSS)


def beside(
    setup: Setup, episode: Episode, folder: Path, moments: Sequence[Moment], size: Size, kind: str
) -> Iterator[Picture]:
    """Draw an episode beside what the model of a folder makes of it.

    Args:
        setup: of the episode.
        episode: the episode.
        folder: of the model.
        moments: to show.
        size: of each of the three pictures of a moment.
        kind: of the file they are for: stills stand below each other in one picture.

    Returns:
        The pictures, each drawn when it is asked for: one of all moments for stills, one of each for a clip.

    Raises:
        UserError: there is no such model, or it is of another setup.
    """
    found = trained_model(folder, setup.name)
    try:
        shown = model_view(summary(setup, episode), episode, found.model, found.metadata["stride"])
    except ValueError as error:
        raise UserError(f"cannot use the model: {error}") from error
    rows = _with_progress(strips(setup, shown, moments, size), len(moments))
    blocks = iter([list(rows)]) if kind in STILLS else ([row] for row in rows)
    return (board([shown.title], [block]) for block in blocks)


def _with_progress(rows: Iterator[Picture], count: int) -> Iterator[Picture]:
    with ProgressLine("rows of pictures", count, 0) as progress:
        for row in rows:
            yield row
            progress.advance(1, "")


def write_remarkable(
    folder: Path, model: SvaeDc, dataset: Dataset, cache: TrainingCache, stride: int, count: int
) -> list[Path]:
    """A clip and stills of the best, the worst and two random held-out episodes, by objective.

    Args:
        folder: of the files.
        model: in evaluation mode.
        dataset: that the episodes are from.
        cache: of it, at the stride.
        stride: of the training.
        count: moments of the clip.

    Returns:
        The files; none, and it is said why, where there is nothing to see.
    """
    try:
        setup = setup_of(dataset.identity.setup, dataset.identity.bad_name)
        scenery_of(setup)
        return write_model_frames(folder, _remarkable(dataset, cache, model, stride), setup, count)
    except (UsageError, LookupError, ValueError) as error:
        say(f"no pictures of the model's motions: {error.args[0]}")
        return []


def _remarkable(dataset: Dataset, cache: TrainingCache, model: SvaeDc, stride: int) -> list[ModelView]:
    rows = cache.held_out()
    chosen = remarkable(np.asarray(cache.f[rows]), np.random.default_rng(0))
    indices = {name: int(cache.episode[rows[position]]) for name, position in chosen.items()}
    tellings = []
    for name, index in indices.items():
        episode = dataset.episode(index)
        title = f"{name} of {len(rows)} held-out episodes: {index}, objective {episode.f:+.2f}"
        tellings.append(model_view(title, episode, model, stride))
    return tellings


def write_model_frames(folder: Path, tellings: Sequence[ModelView], setup: Setup, count: int) -> list[Path]:
    """Write `motions.gif` and, of its moments, `motions.png`.

    Args:
        folder: of the files.
        tellings: of episodes of the setup.
        setup: that the episodes are of.
        count: moments of the clip; the stills have the last of each third.

    Returns:
        Paths of the stills and of the clip.

    Raises:
        LookupError: there is nothing to see.
    """
    titles = [each.title for each in tellings]
    blocks: list[list[Picture]] = []
    with ProgressLine("rows of pictures", count * len(tellings), 0) as progress:
        for each in tellings:
            blocks.append([])
            # All begin alike, so the first step is left out.
            for strip in strips(setup, each, stills(setup, each.episode, count + 1)[1:], SMALL):
                blocks[-1].append(strip)
                progress.advance(1, "")
    chosen = sorted({math.ceil(count * part / DOWN) - 1 for part in range(1, DOWN + 1)})
    still = board(titles, [[block[moment] for moment in chosen] for block in blocks])
    clip = [board(titles, [[strip] for strip in together]) for together in zip(*blocks, strict=True)]
    made = {folder / "motions.png": [still], folder / "motions.gif": clip}
    for path, pictures in made.items():
        with replacing(path) as unfinished:
            write(unfinished, path.suffix, iter(pictures), RATE)
    return list(made)


def badness_note(y: float) -> str:
    """What is written at the top right; nothing where the model knows nothing of badness."""
    return "" if math.isnan(y) else f"bad {y:.0%}"
