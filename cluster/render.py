"""The pictures of an episode: which moments are shown, and what is written on them."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from cluster.captions import captioned
from cluster.errors import UsageError
from cluster.film import Picture
from cluster.progress import ProgressLine
from workers.pictures import Size, frames
from workers.rollout import Episode
from workers.setups import Setup

SHORTEST, LONGEST = 5.0, 8.0  # s of a clip whose speed nobody chose


@dataclass(frozen=True)
class Moment:
    """One picture: the step it shows, and the bits of the bad conditions written on it."""

    step: int
    bits: int


def usual_speed(setup: Setup) -> float:
    """That of life if a clip then lasts 5 to 8 s, and the nearest that makes it so otherwise."""
    seconds = setup.horizon * setup.control_step
    return seconds / min(max(seconds, SHORTEST), LONGEST)


def clip(setup: Setup, episode: Episode, speed: float, rate: int) -> list[Moment]:
    """Moments evenly over an episode; each tells every condition that held since the one before.

    Args:
        setup: of the episode.
        episode: the episode.
        speed: 1 is that of life.
        rate: pictures per second.

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
    bits = np.bitwise_or.reduceat(episode.bad, edges[:-1])
    return [Moment(int(stop) - 1, int(held)) for stop, held in zip(edges[1:], bits, strict=True)]


def stills(setup: Setup, episode: Episode, count: int) -> list[Moment]:
    """Moments evenly over an episode, its first and last step among them; each tells what holds just then."""
    steps = np.rint(np.linspace(0, setup.horizon - 1, count)).astype(int)
    return [Moment(int(step), int(episode.bad[step])) for step in steps]


def pictures(
    setup: Setup, episode: Episode, moments: Sequence[Moment], size: Size, note: str
) -> Iterator[Picture]:
    """The moments of an episode as pictures, with time, conditions and the note written on them."""
    steps = [moment.step for moment in moments]
    drawn = frames(setup, episode.xi, steps, size)
    with ProgressLine("pictures", len(steps), 0) as progress:
        for moment, picture in zip(moments, drawn, strict=True):
            corner = f"{(moment.step + 1) * setup.control_step:.2f} s"
            yield captioned(picture, corner, note, conditions(setup, moment.bits))
            progress.advance(1, "")


def conditions(setup: Setup, bits: int) -> tuple[str, ...]:
    """Names of the bad conditions whose bits are set."""
    return tuple(name for number, name in enumerate(setup.conditions) if bits >> number & 1)


def summary(setup: Setup, episode: Episode) -> str:
    """One line: objective, badness, which conditions made it, and why the episode stopped."""
    reasons = conditions(setup, int(np.bitwise_or.reduce(episode.bad)))
    stopped = f"; stopped: {episode.stop}" if episode.stop else ""
    because = f" ({', '.join(reasons)})" if reasons else ""
    return f"{setup.name}: objective {episode.f:+.3g}, {episode.y:.0%} of the steps bad{because}{stopped}"
